in vec3 place;
in vec2 at;
uniform vec3 u, v, ground, line, paper;
uniform vec2 half_size, middle;
uniform float cell, reach;          // m: of the grid; where it has faded away, 0: nowhere
uniform bool ghost;                 // the grid alone, without a ground
#include light
out vec4 pixel;

// How much of a pixel the lines of a grid cover; nothing where cells are no larger than pixels.
float drawn(vec2 cells) {
  vec2 wide = fwidth(cells), near = abs(fract(cells - 0.5) - 0.5) / max(wide, 1e-9);
  return clamp(1.2 - min(near.x, near.y), 0.0, 1.0) * clamp(1.5 - 4.0 * max(wide.x, wide.y), 0.0, 1.0);
}

void main() {
  float grid = max(0.45 * drawn(at / cell), 0.85 * drawn(at / (5.0 * cell)));
  vec2 margin = (half_size - abs(at - middle)) / max(fwidth(at), 1e-9);
  if (reach == 0.0) grid = max(grid, clamp(2.0 - min(margin.x, margin.y), 0.0, 1.0));      // a wall's border
  vec3 normal = normalize(cross(u, v));
  vec3 shade = ghost ? line : lit(mix(ground, line, grid), normal, place, 0.0);
  float left = reach > 0.0 ? 1.0 - smoothstep(0.35, 1.0, length(at - middle) / reach) : 1.0;
  pixel = ghost ? vec4(shade, grid * left) : vec4(mix(paper, shade, left), 1.0);
}
