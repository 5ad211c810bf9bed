#version 150
// Desktop, second of three stages ([VA] sect. 7): divides a triangle of the model as finely as the texture resolves it
// and moves every corner along the model's normal to the scan; twice where a ray met the scan in both directions.

// Two sides of six segments an edge are 96 vertices of 10 components each, within the 1,024 that every implementation
// grants.
const int MOST_SEGMENTS = 6;

layout(triangles) in;
layout(triangle_strip, max_vertices = 96) out;

in vec3 modelNormal[];
in vec2 modelTexCoord[];

out vec3 eye;       // Position in front of the eye.
out vec2 texCoord;
out float known;    // 1 where the scan was met; the fragment stage drops what lies between.
out float hits;

uniform mat4 castle_ModelViewMatrix;
uniform mat4 castle_ProjectionMatrix;
uniform sampler2D distances;

int rowFromTop(int row, int rows) { return rows - 1 - row; }

//!common
//!texel

// The corner with barycentric coordinates w.
void emit(vec3 w, float which) {
  vec3 position = w.x * gl_in[0].gl_Position.xyz + w.y * gl_in[1].gl_Position.xyz + w.z * gl_in[2].gl_Position.xyz;
  vec3 normal = normalize(w.x * modelNormal[0] + w.y * modelNormal[1] + w.z * modelNormal[2]);
  vec2 charted = w.x * modelTexCoord[0] + w.y * modelTexCoord[1] + w.z * modelTexCoord[2];
  // The fragment stage cannot ask for the size of the texture, of which the distances are the upper rows.
  texCoord = vec2(charted.x, 1.0 - (1.0 - charted.y) * distanceRows / float(textureSize(distances, 0).y));
  hits = which;
  vec2 found = deviation(texelFetch(distances, texelAt(charted), 0).rgb, which);
  known = found.y;
  vec4 inEye = castle_ModelViewMatrix * vec4(position + exaggeration * found.x * normal, 1.0);
  eye = inEye.xyz;
  gl_Position = castle_ProjectionMatrix * inEye;
  EmitVertex();
}

void main() {
  vec2 size = vec2(float(textureSize(distances, 0).x), distanceRows);
  float a = length((modelTexCoord[1] - modelTexCoord[0]) * size);
  float b = length((modelTexCoord[2] - modelTexCoord[1]) * size);
  float c = length((modelTexCoord[0] - modelTexCoord[2]) * size);
  int segments = int(clamp(ceil(max(a, max(b, c))), 1.0, float(MOST_SEGMENTS)));
  float divisor = float(segments);
  for (int side = 0; side < 2; side++) {
    // One strip a row, from the edge 0-1 towards corner 2.
    for (int row = 0; row < segments; row++) {
      float low = float(row) / divisor;
      float high = float(row + 1) / divisor;
      for (int i = 0; i <= segments - row; i++) {
        float along = float(i) / divisor;
        emit(vec3(1.0 - low - along, along, low), float(side));
        if (i < segments - row) emit(vec3(1.0 - high - along, along, high), float(side));
      }
      EndPrimitive();
    }
  }
}
