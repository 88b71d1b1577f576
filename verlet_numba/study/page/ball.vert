// A particle as a square that faces the eye; the fragment shader makes it a ball.
layout(location = 0) in vec3 position;
layout(location = 2) in vec3 colour;
layout(location = 4) in float radius;
uniform mat4 matrix;
uniform vec4 eye;
uniform float pixel_size;
out vec3 centre, right, up, outwards, tint;
out vec2 at;
out float thick;

void main() {
  at = vec2(gl_VertexID % 2, gl_VertexID / 2) * 2.0 - 1.0;
  centre = position;
  tint = colour;
  vec3 to_eye = eye.xyz - position * eye.w;
  outwards = normalize(to_eye);
  right = normalize(cross(abs(outwards.z) < 0.9 ? vec3(0.0, 0.0, 1.0) : vec3(1.0, 0.0, 0.0), outwards));
  up = cross(outwards, right);
  thick = max(radius, 0.75 * pixel_size * length(to_eye) * eye.w);
  gl_Position = matrix * vec4(centre + thick * (at.x * right + at.y * up), 1.0);
}
