// Displacement without a geometry stage. A tile is the triangles of the model, so many of them, each divided evenly; one
// tile's vertices are in the file, (triangle of the tile, steps to its second corner, steps to its third), and every
// shape that uses it names the first of its triangles and the hits that it shows: in the translation of its texture, or
// where a viewer does not hand that on, in 2^-24 in the colour of its material. The model's vertices and triangles are in the texture below the distances, three bytes a word, in planes; a plane begins a
// row.
out vec3 eye;       // Position in front of the eye.
out vec2 texCoord;
out float known;    // 1 where the scan was met; the fragment stage drops what lies between.
flat out float hits;

uniform sampler2D distances;
uniform float vertexPlane;   // Words of a plane of vertices.
uniform float trianglePlane; // Words of a plane of triangles.
uniform float triangleCount;
uniform float segments;      // Segments an edge of a triangle.
uniform float tileTriangles; // Triangles of a tile.
uniform vec3 boxSize;        // Of the model, in millimetres; its middle is the origin.

//!common
//!texel
vec3 word(int place) {
  ivec2 size = textureSize(distances, 0);
  ivec2 at = ivec2(place % size.x, rowFromTop(place / size.x + int(distanceRows), size.y));
  return floor(texelFetch(distances, at, 0).rgb * 255.0 + 0.5);
}

int corner(int triangle, int which) {
  vec3 bytes = word(4 * int(vertexPlane) + which * int(trianglePlane) + triangle);
  return int(bytes.r + 256.0 * bytes.g + 65536.0 * bytes.b);
}

vec3 place(int vertex) {
  return (256.0 * word(vertex) + word(vertex + int(vertexPlane))) / 65535.0 - 0.5;
}

// Normals are points of the octahedron that is unfolded to a square (Cigolle and others, 'A Survey of Efficient
// Representations for Independent Unit Vectors', 2014).
vec3 unitNormal(vec2 square) {
  vec3 n = vec3(square, 1.0 - abs(square.x) - abs(square.y));
  if (n.z < 0.0) n.xy = (1.0 - abs(n.yx)) * vec2(n.x < 0.0 ? -1.0 : 1.0, n.y < 0.0 ? -1.0 : 1.0);
  return normalize(n);
}

void attributes(int vertex, out vec3 normal, out vec2 st) {
  vec3 high = word(vertex + 2 * int(vertexPlane));
  vec3 low = word(vertex + 3 * int(vertexPlane));
  st = (256.0 * high.rg + low.rg) / 65535.0;
  normal = unitNormal(vec2(high.b, low.b) / 127.5 - 1.0);
}

void main() {
  vec3 vertex = tileVertex();
  int triangle = int(tile().x + 0.5) + int(vertex.x + 0.5);
  hits = floor(tile().y + 0.5);
  eye = vec3(0.0);
  texCoord = vec2(0.0);
  known = 0.0;
  // The last tile has fewer: all corners of the others lie at one point.
  if (triangle >= int(triangleCount)) {
    gl_Position = vec4(0.0, 0.0, 2.0, 1.0);
    return;
  }
  vec3 w = vec3(segments - vertex.y - vertex.z, vertex.yz) / segments;
  vec3 position = vec3(0.0);
  vec3 normal = vec3(0.0);
  for (int i = 0; i < 3; i++) {
    int at = corner(triangle, i);
    vec3 n;
    vec2 t;
    attributes(at, n, t);
    position += w[i] * place(at);
    normal += w[i] * n;
    texCoord += w[i] * t;
  }
  vec2 found = deviation(texelFetch(distances, texelAt(texCoord), 0).rgb, hits);
  known = found.y;
  // The tile's box, in whose units its vertices are, was made that of the model by a Transform, so that viewers know
  // where the shape is; here its units are left again.
  vec3 tileBox = vec3(tileTriangles, segments, segments);
  vec3 moved = (position + exaggeration * found.x * normalize(normal) / boxSize + 0.5) * tileBox;
  vec4 inEye = toEye() * vec4(moved, 1.0);
  eye = inEye.xyz;
  gl_Position = toScreen() * inEye;
}
