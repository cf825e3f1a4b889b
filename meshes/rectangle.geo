// Rectangle with the inlet at x = 0, the outlet at x = length and walls at y = 0 and y = width,
// cut into equal squares whose diagonals alternate as those of a gap on a grid do.
DefineConstant[ length = 1, width = 1, mesh_size = 0.25 ];

Point(1) = {0, 0, 0};
Point(2) = {length, 0, 0};
Point(3) = {length, width, 0};
Point(4) = {0, width, 0};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 1};
Curve Loop(1) = {1, 2, 3, 4};
Plane Surface(1) = {1};
Transfinite Curve{1, 3} = Max(1, Ceil(length / mesh_size - 1e-6)) + 1;
Transfinite Curve{2, 4} = Max(1, Ceil(width / mesh_size - 1e-6)) + 1;
Transfinite Surface{1} AlternateLeft;

Physical Curve("inlet") = {4};
Physical Curve("outlet") = {2};
Physical Curve("wall") = {1, 3};
Physical Surface("film") = {1};
