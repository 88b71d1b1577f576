in vec3 axis, sideways, outwards, tint;
in float across, thick;
uniform mat4 matrix;
#ifndef ONLY_DEPTH
#include light
out vec4 pixel;
#endif

void main() {
  vec3 normal = across * sideways + sqrt(max(1.0 - across * across, 0.0)) * outwards;
  vec3 place = axis + thick * normal;
  vec4 seen = matrix * vec4(place, 1.0);
  gl_FragDepth = 0.5 + 0.5 * seen.z / seen.w;
#ifndef ONLY_DEPTH
  pixel = vec4(lit(tint, normalize(normal), place, 0.15), 1.0);
#endif
}
