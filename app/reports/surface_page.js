// Two surfaces from one viewpoint, to the left and to the right of a line.

const MESH_VERTEX = `#version 300 es
uniform mat4 view;
in vec3 place;
in vec4 color;
in vec2 uv;
out vec4 tint;
out vec2 at;
void main() { tint = color; at = uv; gl_Position = view * vec4(place, 1.0); }`;
const MESH_FRAGMENT = `#version 300 es
precision highp float;
uniform sampler2D picture;
in vec4 tint;
in vec2 at;
out vec4 color;
vec3 linear(vec3 c) { return mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), step(0.04045, c)); }
vec3 srgb(vec3 c) { return mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c)); }
void main() { color = vec4(srgb(linear(texture(picture, at).rgb) * tint.rgb), 1.0); }`;
const ARRAYS = {5123: Uint16Array, 5125: Uint32Array, 5126: Float32Array};

// Return positions in metres; steps have a fourth, empty column.
function inMetres(places, {translation = [0, 0, 0], scale = [1, 1, 1]}) {
  if (places instanceof Float32Array) return places;
  return Float32Array.from({length: 3 * places.length / 4}, (_, at) => {
    const axis = at % 3;
    return translation[axis] + scale[axis] * places[4 * (at - axis) / 3 + axis];
  });
}

// Read the one primitive of a binary glTF as app/drawing/glb.py writes it.
function readGlb(bytes) {
  const length = new DataView(bytes.buffer).getUint32(12, true), body = 28 + length;
  const head = JSON.parse(new TextDecoder().decode(bytes.subarray(20, 20 + length)));
  const part = row => {
    const {byteOffset, byteLength} = head.bufferViews[row];
    return bytes.slice(body + byteOffset, body + byteOffset + byteLength);
  };
  const array = row => row === undefined ? null : new ARRAYS[head.accessors[row].componentType](part(row).buffer);
  const {attributes, indices} = head.meshes[0].primitives[0];
  return {
    places: inMetres(array(attributes.POSITION), head.nodes[0]),
    colors: array(attributes.COLOR_0),
    uv: array(attributes.TEXCOORD_0),
    triangles: array(indices),
    picture: head.images ? new Blob([part(head.images[0].bufferView)], {type: head.images[0].mimeType}) : null,
  };
}

class Split extends View {
  constructor(canvas, from) {
    super(canvas, from);
    this.share = 0.5;
    this.meshes = [null, null];
  }

  prepare() {
    this.worn = this.program(MESH_VERTEX, MESH_FRAGMENT, ["place", "color", "uv"]);
    this.white = this.texture(new ImageData(new Uint8ClampedArray([255, 255, 255, 255]), 1, 1));
    this.gl.enable(this.gl.CULL_FACE); // as in the app: the view from outside goes into the room
  }

  async load(side, glb) {
    const gl = this.gl, mesh = readGlb(glb), bitmap = mesh.picture && await createImageBitmap(mesh.picture);
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    this.attribute(0, mesh.places, gl.FLOAT, false, 3);
    this.attribute(1, mesh.colors, gl.UNSIGNED_SHORT, true, 4);
    if (mesh.uv) this.attribute(2, mesh.uv, gl.UNSIGNED_SHORT, true, 2);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint32Array(mesh.triangles), gl.STATIC_DRAW);
    gl.bindVertexArray(null);
    this.meshes[side] = {array, count: mesh.triangles.length, picture: bitmap ? this.photograph(bitmap) : this.white};
    this.draw();
  }

  photograph(bitmap) {
    const gl = this.gl, texture = this.texture(bitmap);
    gl.generateMipmap(gl.TEXTURE_2D);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR);
    return texture;
  }

  paint() {
    if (!this.begin()) return;
    const gl = this.gl, {width, height} = this.canvas, cut = Math.round(this.share * width);
    gl.useProgram(this.worn);
    gl.uniformMatrix4fv(gl.getUniformLocation(this.worn, "view"), false, this.camera().matrix);
    gl.enable(gl.SCISSOR_TEST);
    this.meshes.forEach((mesh, side) => {
      if (!mesh) return;
      gl.scissor(side ? cut : 0, 0, side ? width - cut : cut, height);
      gl.bindTexture(gl.TEXTURE_2D, mesh.picture);
      gl.bindVertexArray(mesh.array);
      gl.drawElements(gl.TRIANGLES, mesh.count, gl.UNSIGNED_INT, 0);
    });
    gl.bindVertexArray(null);
    gl.disable(gl.SCISSOR_TEST);
  }
}

function showLegend({text, swatches, bar}) {
  const box = find("legend"), make = (tag, into) => into.appendChild(document.createElement(tag));
  box.append(text);
  for (const swatch of swatches) {
    const item = make("span", box);
    make("i", item).style.background = swatch.color;
    item.append(swatch.text);
  }
  if (!bar) return;
  const item = make("div", box);
  item.className = "bar";
  make("i", item).style.background = `linear-gradient(to right, ${bar.stops.join(", ")})`;
  const labels = make("div", item);
  for (const label of bar.labels) make("span", labels).textContent = label;
}

{
  const record = JSON.parse(find("record").textContent), [left, right] = record.sides;
  const stage = new Split(find("stage").querySelector("canvas"), record.view);
  const split = find("split"), line = find("line");
  const move = share => {
    stage.share = clamp(share, 0, 1);
    line.style.left = `${100 * stage.share}%`;
    split.value = 100 * stage.share;
    stage.draw();
  };
  split.ariaLabel = `How much of the picture shows ${left.name}`;
  split.addEventListener("input", () => move(split.value / 100));
  line.addEventListener("pointerdown", event => line.setPointerCapture(event.pointerId));
  line.addEventListener("pointermove", event => {
    const box = find("stage").getBoundingClientRect();
    if (event.buttons) move((event.clientX - box.left) / box.width);
  });
  for (const [id, end, side] of [["left", "less", left], ["right", "more", right]]) {
    find(id).appendChild(document.createElement("b")).textContent = side.name;
    find(id).append(side.note);
    find(end).textContent = side.name;
  }
  showLegend(record.legend);
  find("light").addEventListener("click", () => toggleLight());
  move(0.5);
  if (!stage.gl) find("hint").textContent = "This browser has no WebGL2, and so cannot draw the surfaces.";
  else Promise.all(record.sides.map((side, row) => side.there && stage.load(row, bytesOf(`mesh-${row}`))))
    .then(() => { document.documentElement.dataset.ready = true; });
}
