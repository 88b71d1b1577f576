layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec3 colour;
uniform mat4 matrix, model;
out vec3 place, across, tint;

void main() {
  place = (model * vec4(position, 1.0)).xyz;
  across = mat3(model) * normal;
  tint = colour;
  gl_Position = matrix * vec4(place, 1.0);
}
