// An embankment in three lifts on level ground, and a pit of two benches that is dug beside it: lengths in metres.
// y is upwards from the surface. Change the numbers here; the lines below follow.
rise = 1.5;      // of a lift
bench = 1.5;     // depth of a bench
slope = 1.5;     // run over rise of the slopes
crest = 3.0;     // half width of the crest
pit = 12.0;      // from the axis to the pit
floor = 4.0;     // width of the floor of the pit
depth = 8.0;     // of the ground
size = 1.0;      // of the cells

half = crest + 3 * rise * slope;            // half width of the foot
edge = pit + 2 * bench * slope;             // where the floor of the pit begins
end = edge + floor;                         // the axis of the pit

// The surface from the axis of the embankment to the axis of the pit, and the ground below it.
Point(1) = {0, 0, 0, size};
Point(2) = {half, 0, 0, size};
Point(3) = {pit, 0, 0, size};
Point(4) = {pit + bench * slope, -bench, 0, size};
Point(5) = {edge, -2 * bench, 0, size};
Point(6) = {end, -2 * bench, 0, size};
Point(7) = {end, -depth, 0, size};
Point(8) = {0, -depth, 0, size};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 5};
Line(5) = {5, 6};
Line(6) = {6, 7};
Line(7) = {7, 8};
Line(8) = {8, 1};
Curve Loop(1) = {1, 2, 3, 4, 5, 6, 7, 8};
Plane Surface(1) = {1};

// Two benches of the pit, which are ground at first.
Point(9) = {end, 0, 0, size};
Point(10) = {end, -bench, 0, size};
Line(9) = {3, 9};
Line(10) = {9, 10};
Line(11) = {10, 4};
Line(12) = {10, 6};
Curve Loop(2) = {9, 10, 11, -3};
Plane Surface(2) = {2};
Curve Loop(3) = {-11, 12, -5, -4};
Plane Surface(3) = {3};

// Three lifts, half of each.
Point(11) = {0, rise, 0, size};
Point(12) = {half - rise * slope, rise, 0, size};
Point(13) = {0, 2 * rise, 0, size};
Point(14) = {half - 2 * rise * slope, 2 * rise, 0, size};
Point(15) = {0, 3 * rise, 0, size};
Point(16) = {crest, 3 * rise, 0, size};
Line(21) = {2, 12};
Line(22) = {12, 11};
Line(23) = {11, 1};
Line(24) = {12, 14};
Line(25) = {14, 13};
Line(26) = {13, 11};
Line(27) = {14, 16};
Line(28) = {16, 15};
Line(29) = {15, 13};
Curve Loop(4) = {1, 21, 22, 23};
Plane Surface(4) = {4};
Curve Loop(5) = {-22, 24, 25, 26};
Plane Surface(5) = {5};
Curve Loop(6) = {-25, 27, 28, 29};
Plane Surface(6) = {6};

Physical Surface("ground") = {1};
Physical Surface("bench_1") = {2};
Physical Surface("bench_2") = {3};
Physical Surface("lift_1") = {4};
Physical Surface("lift_2") = {5};
Physical Surface("lift_3") = {6};
Physical Curve("rock") = {7};
Physical Curve("axes") = {6, 8, 10, 12, 23, 26, 29};
