// Strip between two side walls, y = 0 and y = width, in triangles of no pattern.
DefineConstant[ length = 2, width = 1, mesh_size = 0.1 ];

Point(1) = {0, 0, 0, mesh_size};
Point(2) = {length, 0, 0, mesh_size};
Point(3) = {length, width, 0, mesh_size};
Point(4) = {0, width, 0, mesh_size};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 1};
Curve Loop(1) = {1, 2, 3, 4};
Plane Surface(1) = {1};

Physical Curve("inlet") = {4};
Physical Curve("outlet") = {2};
Physical Curve("wall") = {1, 3};
Physical Surface("film") = {1};
