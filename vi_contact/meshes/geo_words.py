"""List the words that a Gmsh script may have if the package is to mesh it.

``geo_script`` refuses all others.
"""

_WORDS = """
SetFactory Point Line Curve Circle Ellipse Spline BSpline Bezier Wire Loop Plane Ruled Surface
Volume Physical Rectangle Disk Box Sphere Cylinder Cone Torus Wedge Extrude Translate Rotate
Symmetry Dilate Duplicata Delete Recursive Boundary CombinedBoundary BooleanUnion
BooleanIntersection BooleanDifference BooleanFragments Fillet Coherence Transfinite Recombine
Layers Using Progression Bump Left Right Alternate Compound Periodic Reverse In Mesh MeshSize
Characteristic Length Field Background Distance Attractor Threshold Ball Min Max MathEval
Constant Restrict For EndFor If ElseIf Else EndIf DefineConstant Pi Sqrt Sin Cos Tan Asin Acos
Atan Atan2 Exp Log Log10 Fabs Floor Ceil Round newp newl newc newll newcl news newsl newv newreg
newf
"""
_OPTIONS = """
Algorithm Algorithm3D CharacteristicLengthMin CharacteristicLengthMax CharacteristicLengthFactor
MeshSizeMin MeshSizeMax MeshSizeFactor CharacteristicLengthExtendFromBoundary
CharacteristicLengthFromPoints CharacteristicLengthFromCurvature MeshSizeExtendFromBoundary
MeshSizeFromPoints MeshSizeFromCurvature ElementOrder SecondOrderIncomplete Optimize
OptimizeNetgen RecombineAll RecombinationAlgorithm Smoothing SubdivisionAlgorithm
"""
_FIELDS = """
CurvesList EdgesList PointsList NodesList SurfacesList FacesList VolumesList RegionsList
NumPointsPerCurve NNodesByEdge Sampling InField IField DistMin DistMax SizeMin SizeMax LcMin
LcMax Sigmoid StopAtDistMax FieldsList VIn VOut XMin XMax YMin YMax ZMin ZMax Thickness Radius
XCenter YCenter ZCenter XAxis YAxis ZAxis F
"""
_UNSEEN_OF_MESH = """
MshFileVersion Format Binary SaveAll SaveGroupsOfNodes SaveGroupsOfElements SaveElementTagType
SaveParametric SaveTopology FileFormat Color ColorCarousel Light LightLines LightTwoSide
SmoothNormals Explode LabelType LabelSampling Points Lines Triangles Quadrangles Tetrahedra
Hexahedra Prisms Pyramids Nodes PointNumbers PointSize PointType LineNumbers LineWidth
NodeLabels LineLabels SurfaceEdges SurfaceFaces SurfaceNumbers SurfaceLabels VolumeEdges
VolumeFaces VolumeNumbers VolumeLabels NumSubEdges Normals Tangents Voronoi Dual DrawSkinOnly
RadiusInf RadiusSup QualityInf QualitySup QualityType MaxNumThreads1D MaxNumThreads2D
MaxNumThreads3D ReadGroupsOfElements
"""
_UNSEEN_OF_GEOMETRY = """
Color Points Lines Curves Surfaces Volumes PointNumbers LineNumbers CurveNumbers SurfaceNumbers
VolumeNumbers PointLabels CurveLabels SurfaceLabels VolumeLabels PointSize PointType
PointSelectSize LineWidth CurveWidth CurveType LineType LabelType Light LightTwoSide Normals
Tangents NumSubEdges SurfaceType Transform HideCompounds HighlightOrphans
"""
_PARAMETERS = """
Name Min Max Step Range Choices Closed Label Help Highlight ReadOnly Visible NumberFormat Units
AutoCheck Loop Graph GmshOption ServerAction ServerActionReset ServerActionSet Kind Path
ReadOnlyRange NeverChanged ChangedValue Description
"""

# Geometry, sizes, groups and arithmetic. None of them opens a file or starts a process.
WORDS = frozenset(_WORDS.split())
# Words that may follow "Mesh."; all of them take numbers.
MESH_OPTIONS = frozenset(_OPTIONS.split())
# Words that may follow "Field[1].".
FIELD_OPTIONS = frozenset(_FIELDS.split())
# Words after "Mesh." that change what a window shows or how a file is written: their statements are
# left out.
UNSEEN_OF_MESH = frozenset(_UNSEEN_OF_MESH.split())
# The same after "Geometry.".
UNSEEN_OF_GEOMETRY = frozenset(_UNSEEN_OF_GEOMETRY.split())
# Parameters of DefineConstant that tell a window how to show a value: they are left out.
PARAMETERS = frozenset(_PARAMETERS.split())
