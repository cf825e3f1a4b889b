// Annular face seal around the origin: the fluid is inside, at inner_radius, and leaks outwards.
DefineConstant[ inner_radius = 1, outer_radius = 2, mesh_size = 0.1 ];

Point(1) = {0, 0, 0};
For k In {0:3}
  Point(2 + k) = {inner_radius * Cos(k * Pi / 2), inner_radius * Sin(k * Pi / 2), 0, mesh_size};
  Point(6 + k) = {outer_radius * Cos(k * Pi / 2), outer_radius * Sin(k * Pi / 2), 0, mesh_size};
EndFor
For k In {0:3}
  Circle(1 + k) = {2 + k, 1, 2 + (k + 1) % 4};
  Circle(5 + k) = {6 + k, 1, 6 + (k + 1) % 4};
EndFor
Curve Loop(1) = {5:8};
Curve Loop(2) = {1:4};
Plane Surface(1) = {1, 2};

Physical Curve("inlet") = {1:4};
Physical Curve("outlet") = {5:8};
Physical Surface("film") = {1};
