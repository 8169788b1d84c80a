#version 300 es
precision mediump float;
in vec2 face;
flat in float light, touched, vast;
in float fog;
uniform vec3 paper, body, accent;
out vec4 colour;
void main() {
  vec2 pixel = fwidth(face);
  vec2 inside = smoothstep(vec2(0.0), 1.6 * pixel, min(face, 1.0 - face));
  // Boxes of a few pixels have no edges.
  float edge = (1.0 - inside.x * inside.y) * clamp(1.4 - 8.0 * max(pixel.x, pixel.y), 0.0, 1.0);
  // Boxes as wide as the scene would hide it: only their edges are drawn.
  if (vast > 0.5 && edge < 0.3) discard;
  vec3 own = mix(body, accent, touched) * light;
  colour = vec4(mix(mix(own, paper, 0.35 * edge), paper, 0.6 * fog * fog), 1.0);
}
