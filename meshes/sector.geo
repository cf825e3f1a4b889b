// Sector of a face seal from theta = 0 to theta = angle, walls along both radii; angle < 2 Pi.
DefineConstant[ inner_radius = 1, outer_radius = 2, angle = 1, mesh_size = 0.1 ];

// An arc of a circle must be shorter than half a turn.
n = Floor(angle / 2) + 1;
Point(1) = {0, 0, 0};
For k In {0:n}
  t = k * angle / n;
  Point(10 + k) = {inner_radius * Cos(t), inner_radius * Sin(t), 0, mesh_size};
  Point(20 + k) = {outer_radius * Cos(t), outer_radius * Sin(t), 0, mesh_size};
EndFor
For k In {0:n-1}
  Circle(10 + k) = {10 + k, 1, 11 + k};
  Circle(20 + k) = {20 + k, 1, 21 + k};
EndFor
Line(1) = {10, 20};
Line(2) = {10 + n, 20 + n};
Curve Loop(1) = {1, 20:(20 + n - 1), -2, -(10 + n - 1):-10};
Plane Surface(1) = {1};

Physical Curve("inlet") = {10:(10 + n - 1)};
Physical Curve("outlet") = {20:(20 + n - 1)};
Physical Curve("wall") = {1, 2};
Physical Surface("film") = {1};
