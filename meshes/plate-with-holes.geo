// Strip with holes_x times holes_y round pillars in a rectangular array, impermeable: each hole
// stands in the middle of its cell, so that the strip is a part of the endless array.
DefineConstant[ length = 2, width = 1, holes_x = 2, holes_y = 1, radius = 0.3, mesh_size = 0.1 ];

Point(1) = {0, 0, 0, mesh_size};
Point(2) = {length, 0, 0, mesh_size};
Point(3) = {length, width, 0, mesh_size};
Point(4) = {0, width, 0, mesh_size};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 1};
Curve Loop(1) = {1:4};

loops[] = {1};
rims[] = {};
For i In {0:holes_x-1}
  For j In {0:holes_y-1}
    x = (i + 0.5) * length / holes_x;
    y = (j + 0.5) * width / holes_y;
    p = newp;
    Point(p) = {x, y, 0};
    For k In {0:3}
      Point(p + 1 + k) = {x + radius * Cos(k * Pi / 2), y + radius * Sin(k * Pi / 2), 0, mesh_size};
    EndFor
    c = newl;
    For k In {0:3}
      Circle(c + k) = {p + 1 + k, p, p + 1 + (k + 1) % 4};
    EndFor
    loop = newll;
    Curve Loop(loop) = {c:c+3};
    loops[] += {loop};
    rims[] += {c:c+3};
  EndFor
EndFor
Plane Surface(1) = {loops[]};

Physical Curve("inlet") = {4};
Physical Curve("outlet") = {2};
Physical Curve("wall") = {1, 3, rims[]};
Physical Surface("film") = {1};
