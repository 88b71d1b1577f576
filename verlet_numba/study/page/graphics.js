// The little of WebGL2 that is needed: programs whose uniforms are set by name, buffers, vertex arrays, a depth map.

class Program {
  // `onlyDepth`: the same shapes without light, for the shadow map.
  constructor(gl, name, onlyDepth = false) {
    this.gl = gl;
    this.program = gl.createProgram();
    const head = "#version 300 es\nprecision highp float;\n" + (onlyDepth ? "#define ONLY_DEPTH\n" : "");
    for (const [kind, ending] of [[gl.VERTEX_SHADER, "vert"], [gl.FRAGMENT_SHADER, "frag"]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, head + SHADERS[`${name}.${ending}`]);
      gl.compileShader(shader);
      gl.attachShader(this.program, shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) {
        throw new Error(`${name}.${ending}: ${gl.getShaderInfoLog(shader)}`);
      }
    }
    gl.linkProgram(this.program);
    if (!gl.getProgramParameter(this.program, gl.LINK_STATUS) && !gl.isContextLost()) {
      throw new Error(`${name}: ${gl.getProgramInfoLog(this.program)}`);
    }
    this.setters = {};
    const count = gl.getProgramParameter(this.program, gl.ACTIVE_UNIFORMS);
    for (let k = 0; k < count; k++) {
      const { name: uniform, type } = gl.getActiveUniform(this.program, k);
      const place = gl.getUniformLocation(this.program, uniform);
      this.setters[uniform] = {
        [gl.FLOAT]: (value) => gl.uniform1f(place, value), [gl.FLOAT_VEC2]: (value) => gl.uniform2fv(place, value),
        [gl.FLOAT_VEC3]: (value) => gl.uniform3fv(place, value), [gl.FLOAT_VEC4]: (value) => gl.uniform4fv(place, value),
        [gl.FLOAT_MAT4]: (value) => gl.uniformMatrix4fv(place, false, value), [gl.BOOL]: (value) => gl.uniform1i(place, value),
        [gl.SAMPLER_2D_SHADOW]: (value) => gl.uniform1i(place, value),
      }[type];
    }
  }

  use(uniforms) {
    this.gl.useProgram(this.program);
    for (const [name, value] of Object.entries(uniforms)) this.setters[name]?.(value);
  }
}

// Attributes: name -> {data or buffer, size, type, each: per instance, stride, offset}; all programs know them by these places.
const PLACES = { position: 0, normal: 1, colour: 2, start: 0, end: 1, start_colour: 2, end_colour: 3, radius: 4 };

function vertexArray(gl, attributes, indices) {
  const array = gl.createVertexArray();
  gl.bindVertexArray(array);
  for (const [name, { buffer, size = 3, type = gl.FLOAT, stride = 0, offset = 0, each = false }] of Object.entries(attributes)) {
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.enableVertexAttribArray(PLACES[name]);
    gl.vertexAttribPointer(PLACES[name], size, type, type === gl.UNSIGNED_BYTE, stride, offset);
    if (each) gl.vertexAttribDivisor(PLACES[name], 1);
  }
  if (indices) {
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STATIC_DRAW);
  }
  gl.bindVertexArray(null);
  return array;
}

function filled(gl, data, usage = gl.STATIC_DRAW) {
  const buffer = gl.createBuffer();
  gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
  gl.bufferData(gl.ARRAY_BUFFER, data, usage);
  return buffer;
}

function refill(gl, buffer, data) {
  gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
  gl.bufferSubData(gl.ARRAY_BUFFER, 0, data);
}

// A square depth map that answers, softly, whether a place is nearer than what it holds.
function depthMap(gl, size) {
  const texture = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.texStorage2D(gl.TEXTURE_2D, 1, gl.DEPTH_COMPONENT24, size, size);
  for (const [key, value] of [[gl.TEXTURE_MIN_FILTER, gl.LINEAR], [gl.TEXTURE_MAG_FILTER, gl.LINEAR], [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE],
    [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE], [gl.TEXTURE_COMPARE_MODE, gl.COMPARE_REF_TO_TEXTURE]]) gl.texParameteri(gl.TEXTURE_2D, key, value);
  const frame = gl.createFramebuffer();
  gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, texture, 0);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  return { texture, frame, size };
}
