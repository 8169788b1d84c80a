#version 300 es
// Three faces of each box: those towards the camera.
layout(location = 0) in vec3 low;
layout(location = 1) in vec3 high;
layout(location = 2) in float hits;
uniform vec3 eye, right, up, ahead;
uniform vec4 lens; // scale of x and y, near, far
uniform vec2 scene; // distance of the middle, radius
out vec2 face;
flat out float light, touched, vast;
out float fog;
const vec2 CORNERS[6] = vec2[](vec2(0, 0), vec2(1, 0), vec2(0, 1), vec2(0, 1), vec2(1, 0), vec2(1, 1));
void main() {
  int axis = gl_VertexID / 6;
  face = CORNERS[gl_VertexID % 6];
  bool upper = eye[axis] > 0.5 * (low[axis] + high[axis]);
  vec3 corner;
  corner[axis] = upper ? 1.0 : 0.0;
  corner[(axis + 1) % 3] = face.x;
  corner[(axis + 2) % 3] = face.y;
  light = axis == 2 ? (upper ? 1.0 : 0.5) : axis == 0 ? 0.8 : 0.65;
  touched = 1.0 - exp2(-hits * 255.0);
  vec3 size = high - low;
  float second = size.x + size.y + size.z - max(size.x, max(size.y, size.z)) - min(size.x, min(size.y, size.z));
  vast = second > scene.y ? 1.0 : 0.0;
  vec3 way = mix(low, high, corner) - eye;
  float depth = dot(way, ahead);
  fog = clamp((depth - scene.x + scene.y) / (2.0 * scene.y), 0.0, 1.0);
  float near = lens.z, far = lens.w;
  float z = (depth * (far + near) - 2.0 * far * near) / (far - near);
  gl_Position = vec4(dot(way, right) * lens.x, dot(way, up) * lens.y, z, depth);
}
