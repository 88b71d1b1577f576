uniform mat4 matrix;
uniform vec3 origin, u, v;
uniform vec2 half_size, middle;     // in u and v from the origin
out vec3 place;
out vec2 at;

void main() {
  at = middle + half_size * (vec2(gl_VertexID % 2, gl_VertexID / 2) * 2.0 - 1.0);
  place = origin + at.x * u + at.y * v;
  gl_Position = matrix * vec4(place, 1.0);
}
