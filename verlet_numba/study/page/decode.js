// From the page's text to numbers: base64, gzip, then whole steps from differences (the other way round: study/pack.py).

async function unpack(text, listed) {
  const letters = atob(text.trim()), bytes = new Uint8Array(letters.length);
  for (let i = 0; i < bytes.length; i++) bytes[i] = letters.charCodeAt(i);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  const buffer = await new Response(stream).arrayBuffer();
  const kinds = { f4: Float32Array, u4: Uint32Array, u1: Uint8Array };
  const arrays = {};
  for (const { name, type, shape, place } of listed) {
    arrays[name] = new kinds[type](buffer, place, shape.reduce((a, b) => a * b, 1));
  }
  return arrays;
}

// (frames, 3, particles) 16-bit steps. Unsigned words wrap around as the encoder's do.
function wholeSteps(planes, frames, particles) {
  const row = 3 * particles, count = frames * row;
  const words = new Uint16Array(count);
  for (let i = 0; i < count; i++) {
    const folded = planes[i] | (planes[count + i] << 8);
    words[i] = (folded >>> 1) ^ -(folded & 1);
  }
  for (let first = 0; first < count; first += particles) {
    for (let i = first + 1; i < first + particles; i++) words[i] += words[i - 1];
  }
  for (const order of [1, 0]) {
    for (let i = (order + 1) * row; i < count; i++) words[i] += words[i - row];
  }
  return words;
}
