uniform highp sampler2DShadow shadow;
uniform mat4 light_matrix;
uniform vec3 light;         // towards it
uniform vec4 eye;
uniform float texel;        // m, of the shadow map

// How much of the sun a place gets, 0 to 1: sixteen looks at the shadow map around it.
float sunny(vec3 place, vec3 normal) {
  vec3 at = (light_matrix * vec4(place + 2.5 * texel * normal, 1.0)).xyz * 0.5 + 0.5;
  if (any(lessThan(at, vec3(0.0))) || any(greaterThan(at, vec3(1.0)))) return 1.0;
  float sum = 0.0, step = 1.1 / float(textureSize(shadow, 0).x);
  for (int i = 0; i < 16; i++) {
    vec2 away = vec2(float(i % 4), float(i / 4)) - 1.5;
    sum += texture(shadow, vec3(at.xy + step * away, at.z - 0.0008));
  }
  return sum / 16.0;
}

// A colour under sky, ground and sun; squares stand for the screen's gamma.
vec3 lit(vec3 colour, vec3 normal, vec3 place, float shine) {
  float sun = max(dot(normal, light), 0.0);
  if (sun > 0.0) sun *= sunny(place, normal);
  vec3 towards = normalize(eye.xyz - place * eye.w);
  float gleam = shine * sun * pow(max(dot(reflect(-light, normal), towards), 0.0), 24.0);
  float around = mix(0.30, 0.50, 0.5 + 0.5 * normal.z) + 0.08 * abs(dot(normal, towards));
  return sqrt(colour * colour * (around + 0.62 * sun) + gleam);
}
