// Flange in millimetres: a ring with bolts through the film, whose sleeves are walls.
DefineConstant[ inner = 20, outer = 40, bolts = 6, bolt_circle = 30, bolt_radius = 3.5, mesh_size = 2 ];

Point(1) = {0, 0, 0};
For k In {0:3}
  Point(2 + k) = {inner * Cos(k * Pi / 2), inner * Sin(k * Pi / 2), 0, mesh_size};
  Point(6 + k) = {outer * Cos(k * Pi / 2), outer * Sin(k * Pi / 2), 0, mesh_size};
EndFor
For k In {0:3}
  Circle(1 + k) = {2 + k, 1, 2 + (k + 1) % 4};
  Circle(5 + k) = {6 + k, 1, 6 + (k + 1) % 4};
EndFor
Curve Loop(1) = {5:8};
Curve Loop(2) = {1:4};

loops[] = {1, 2};
sleeves[] = {};
For b In {0:bolts-1}
  x = bolt_circle * Cos((b + 0.5) * 2 * Pi / bolts);
  y = bolt_circle * Sin((b + 0.5) * 2 * Pi / bolts);
  p = newp;
  Point(p) = {x, y, 0};
  For k In {0:3}
    Point(p + 1 + k) = {x + bolt_radius * Cos(k * Pi / 2), y + bolt_radius * Sin(k * Pi / 2), 0, mesh_size / 2};
  EndFor
  c = newl;
  For k In {0:3}
    Circle(c + k) = {p + 1 + k, p, p + 1 + (k + 1) % 4};
  EndFor
  loop = newll;
  Curve Loop(loop) = {c:c+3};
  loops[] += {loop};
  sleeves[] += {c:c+3};
EndFor
Plane Surface(1) = {loops[]};

Physical Curve("inlet") = {1:4};
Physical Curve("outlet") = {5:8};
Physical Curve("wall") = {sleeves[]};
Physical Surface("film") = {1};
