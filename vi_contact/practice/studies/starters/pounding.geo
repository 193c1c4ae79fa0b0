// Two concrete frames side by side, with a gap between them. Change the numbers below and mesh again: the case file
// pounding.toml names the groups at the end of this file, and nothing else of it. All lengths in metres.
storey = 3.5;        // from floor to floor
slab = 0.5;          // thickness of a floor
bay = 6.0;           // width of a frame, outside
gap = 0.03;          // between the frames
column_left = 0.40;  // width of the columns of the left frame,
floors_left = 3;     // which is tall and soft,
column_right = 0.70; // and of the right one,
floors_right = 2;    // which is low and stiff
along = 6;           // elements along a column of a storey
across = 8;          // elements along a floor

// Both frames are drawn alike: a lattice of four vertical lines and two levels a storey, the bottom and the top of the
// floor. Columns fill the lattice between lines 0 and 1 and between 2 and 3, floors between 1 and 2.
column_surfaces[] = {};
floor_surfaces[] = {};
left_side[] = {};
right_side[] = {};
For frame In {0:1}
  first = 1000 * (frame + 1);
  column = (frame == 0) ? column_left : column_right;
  floors = (frame == 0) ? floors_left : floors_right;
  x0 = frame * (bay + gap);

  For level In {0:2 * floors}
    y = storey * Floor((level + 1) / 2) - slab * (level - 2 * Floor(level / 2));
    Point(first + 4 * level + 0) = {x0, y, 0};
    Point(first + 4 * level + 1) = {x0 + column, y, 0};
    Point(first + 4 * level + 2) = {x0 + bay - column, y, 0};
    Point(first + 4 * level + 3) = {x0 + bay, y, 0};
    // across the columns, and where there is a floor across the bay
    Line(first + 100 + 3 * level + 0) = {first + 4 * level + 0, first + 4 * level + 1};
    Line(first + 100 + 3 * level + 2) = {first + 4 * level + 2, first + 4 * level + 3};
    Transfinite Curve {first + 100 + 3 * level + 0, first + 100 + 3 * level + 2} = 2;
    If (level > 0)
      Line(first + 100 + 3 * level + 1) = {first + 4 * level + 1, first + 4 * level + 2};
      Transfinite Curve {first + 100 + 3 * level + 1} = across + 1;
    EndIf
  EndFor

  For level In {0:2 * floors - 1}
    inside = level - 2 * Floor(level / 2);  // 1 in a floor, 0 below one
    For side In {0:3}
      Line(first + 200 + 4 * level + side) = {first + 4 * level + side, first + 4 * (level + 1) + side};
      Transfinite Curve {first + 200 + 4 * level + side} = (inside == 1) ? 2 : along + 1;
    EndFor
    For part In {0:2}
      If (part != 1 || inside == 1)
        Curve Loop(first + 300 + 3 * level + part) = {
          first + 100 + 3 * level + part, first + 200 + 4 * level + part + 1,
          -(first + 100 + 3 * (level + 1) + part), -(first + 200 + 4 * level + part)};
        Plane Surface(first + 300 + 3 * level + part) = {first + 300 + 3 * level + part};
        Transfinite Surface {first + 300 + 3 * level + part};
        Recombine Surface {first + 300 + 3 * level + part};
        If (part == 1)
          floor_surfaces[] += {first + 300 + 3 * level + part};
        Else
          column_surfaces[] += {first + 300 + 3 * level + part};
        EndIf
      EndIf
    EndFor
    If (frame == 0)
      left_side[] += {first + 200 + 4 * level + 3};
    Else
      right_side[] += {first + 200 + 4 * level + 0};
    EndIf
  EndFor
EndFor

Physical Surface("columns") = column_surfaces[];
Physical Surface("floors") = floor_surfaces[];
Physical Curve("left_foot") = {1100, 1102};
Physical Curve("right_foot") = {2100, 2102};
Physical Curve("left_side") = left_side[];   // the side of the left frame that faces the right one
Physical Curve("right_side") = right_side[]; // and the side that faces it
