// A shaft of stone on a pedestal on rigid ground: lengths in metres, y upwards.
// The origin is the middle of the underside of the pedestal.
B = 3.0;             // width of the pedestal
plinth = 1.2;        // its height
b = 1.2;             // width of the shaft
h = 5.0;             // its height
off = 0.3;           // how far the shaft stands to the right of the middle
size = 0.3;          // of the cells

l = off - b / 2;
r = off + b / 2;
top = plinth + h;

// The pedestal; its top is cut where the shaft begins and ends.
Point(1) = {-B / 2, 0, 0, size};
Point(2) = {B / 2, 0, 0, size};
Point(3) = {B / 2, plinth, 0, size};
Point(4) = {r, plinth, 0, size};
Point(5) = {l, plinth, 0, size};
Point(6) = {-B / 2, plinth, 0, size};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 5};
Line(5) = {5, 6};
Line(6) = {6, 1};
Curve Loop(1) = {1, 2, 3, 4, 5, 6};
Plane Surface(1) = {1};

// The shaft has points of its own in the joint.
Point(11) = {l, plinth, 0, size};
Point(12) = {r, plinth, 0, size};
Point(13) = {r, top, 0, size};
Point(14) = {l, top, 0, size};
Line(11) = {11, 12};
Line(12) = {12, 13};
Line(13) = {13, 14};
Line(14) = {14, 11};
Curve Loop(2) = {11, 12, 13, 14};
Plane Surface(2) = {2};

Transfinite Curve {4, 11} = Ceil(b / size) + 1;

Physical Surface("pedestal") = {1};
Physical Surface("shaft") = {2};
Physical Curve("foot") = {1};
Physical Curve("seat") = {4};
Physical Curve("shaft_foot") = {11};
