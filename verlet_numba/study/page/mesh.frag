in vec3 place, across, tint;
uniform bool faceted, sheet;
#ifdef ONLY_DEPTH
void main() {}
#else
#include light
out vec4 pixel;

void main() {
  vec3 normal = normalize(faceted ? cross(dFdx(place), dFdy(place)) : across);
  if (dot(normal, eye.xyz - place) < 0.0) normal = -normal;
  float side = sheet && !gl_FrontFacing ? 0.78 : 1.0;         // the two sides of a cloth
  pixel = vec4(lit(side * tint, normal, place, 0.10), 1.0);
}
#endif
