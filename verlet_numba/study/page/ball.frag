in vec3 centre, right, up, outwards, tint;
in vec2 at;
in float thick;
uniform mat4 matrix;
#ifndef ONLY_DEPTH
#include light
out vec4 pixel;
#endif

void main() {
  float away = dot(at, at);
  if (away > 1.0) discard;
  vec3 normal = at.x * right + at.y * up + sqrt(1.0 - away) * outwards;
  vec3 place = centre + thick * normal;
  vec4 seen = matrix * vec4(place, 1.0);
  gl_FragDepth = 0.5 + 0.5 * seen.z / seen.w;
#ifndef ONLY_DEPTH
  pixel = vec4(lit(tint, normal, place, 0.25), 1.0);
#endif
}
