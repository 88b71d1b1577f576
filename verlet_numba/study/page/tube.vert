// A segment as a strip that faces the eye; the fragment shader makes it round.
layout(location = 0) in vec3 start;
layout(location = 1) in vec3 end;
layout(location = 2) in vec3 start_colour;
layout(location = 3) in vec3 end_colour;
layout(location = 4) in float radius;
uniform mat4 matrix;
uniform vec4 eye;           // w = 1: a point, 0: a direction
uniform float pixel_size;   // of a pixel at distance 1; nothing is thinner than one and a half
out vec3 axis, sideways, outwards, tint;
out float across, thick;

void main() {
  bool last = gl_VertexID > 1;
  across = gl_VertexID % 2 == 0 ? -1.0 : 1.0;
  axis = last ? end : start;
  tint = last ? end_colour : start_colour;
  vec3 to_eye = eye.xyz - axis * eye.w;
  sideways = cross(end - start, to_eye);
  sideways /= max(length(sideways), 1e-30);
  outwards = normalize(cross(sideways, end - start));
  if (dot(outwards, to_eye) < 0.0) outwards = -outwards;
  thick = max(radius, 0.75 * pixel_size * length(to_eye) * eye.w);
  gl_Position = matrix * vec4(axis + across * thick * sideways, 1.0);
}
