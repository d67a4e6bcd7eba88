// The room in 3-D: the mesh of a moment, and the nodes' frusta with their received pictures.

const VERTEX = `#version 300 es
uniform mat4 view;
uniform vec3 low, step;
in vec3 place;
in vec4 color;
out vec3 seen, at;
void main() { at = low + step * place; seen = color.rgb; gl_Position = view * vec4(at, 1.0); }`;
const FRAGMENT = `#version 300 es
precision highp float;
uniform vec3 eye;
uniform float shine;
in vec3 seen, at;
out vec4 color;
void main() {
  vec3 normal = normalize(cross(dFdx(at), dFdy(at)));
  float light = abs(dot(normal, normalize(eye - at)));
  color = vec4(seen * mix(1.0, 0.72 + 0.28 * light, shine), 1.0);
}`;
const PICTURE_VERTEX = `#version 300 es
uniform mat4 view;
uniform vec3 corner[4];
out vec2 uv;
void main() {
  uv = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1));
  gl_Position = view * vec4(corner[gl_VertexID], 1.0);
}`;
const PICTURE_FRAGMENT = `#version 300 es
precision highp float;
uniform sampler2D picture;
in vec2 uv;
out vec4 color;
void main() { color = texture(picture, uv); }`;
const FRUSTUM = 0.1; // depth of a frustum over the first distance to the middle
const LINE_PX = 3;

class Stage extends View {
  constructor(element, record) {
    super(element.querySelector("canvas"), record.view);
    this.record = record;
    this.names = record.nodes.map(node => {
      const name = element.querySelector("#names").appendChild(document.createElement("span"));
      name.textContent = node.name;
      return name;
    });
    this.pictures = record.nodes.map(() => null);
    this.mesh = null;
    this.meshes = new Map();
  }

  prepare() {
    const gl = this.gl;
    this.solid = this.program(VERTEX, FRAGMENT, ["place", "color"]);
    this.flat = this.program(PICTURE_VERTEX, PICTURE_FRAGMENT, []);
    this.lines = gl.createBuffer();
    this.empty = this.texture(new ImageData(new Uint8ClampedArray([128, 128, 128, 255]), 1, 1));
  }

  // Show a moment's vertices, colours and triangles; they stay on the graphics card for the next time.
  show(moment, mesh, bitmaps) {
    if (!this.gl) return;
    if (!this.meshes.has(moment)) this.meshes.set(moment, this.upload(mesh));
    this.mesh = this.meshes.get(moment);
    this.pictures.forEach(texture => texture && this.gl.deleteTexture(texture));
    this.pictures = bitmaps.map(bitmap => bitmap && this.texture(bitmap));
    this.names.forEach((name, row) => {
      name.textContent = this.record.nodes[row].name + (bitmaps[row] ? "" : ": nothing yet");
    });
    this.draw();
  }

  upload(mesh) {
    const gl = this.gl;
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    this.attribute(0, mesh.positions, gl.UNSIGNED_SHORT, false, 4);
    this.attribute(1, mesh.colors, gl.UNSIGNED_BYTE, true, 4);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, mesh.triangles, gl.STATIC_DRAW);
    gl.bindVertexArray(null);
    return {array, count: mesh.triangles.length};
  }

  paint() {
    if (!this.begin()) return;
    const gl = this.gl;
    const {matrix, eye} = this.camera();
    const at = (program, name) => gl.getUniformLocation(program, name);
    gl.useProgram(this.solid);
    gl.uniformMatrix4fv(at(this.solid, "view"), false, matrix);
    gl.uniform3fv(at(this.solid, "eye"), eye);
    if (this.mesh?.count) {
      gl.uniform1f(at(this.solid, "shine"), 1);
      gl.uniform3fv(at(this.solid, "low"), this.record.box.low_m);
      gl.uniform3fv(at(this.solid, "step"), [0, 1, 2].map(() => this.record.box.step_m));
      gl.bindVertexArray(this.mesh.array);
      gl.drawElements(gl.TRIANGLES, this.mesh.count, gl.UNSIGNED_INT, 0);
      gl.bindVertexArray(null);
    }
    const away = this.record.nodes.map((node, row) => this.paintNode(node, row, matrix, at));
    this.thinNames(away);
  }

  // Draw a frustum's lines as thin bands (WebGL's own lines are too thin), and the picture on its plane. Returns
  // the distance from the viewer.
  paintNode(node, row, matrix, at) {
    const gl = this.gl, depth = FRUSTUM * this.first;
    const pose = node.T_world_camera, [[fx, , cx], [, fy, cy]] = node.matrix, [width, height] = node.size_px;
    const world = (u, v, z) => {
      const p = [(u - cx) / fx * z, (v - cy) / fy * z, z];
      return [0, 1, 2].map(i => dot(pose[i].slice(0, 3), p) + pose[i][3]);
    };
    const corners = [[0, 0], [1, 0], [0, 1], [1, 1]].map(([u, v]) => world(u * width, v * height, depth));
    gl.useProgram(this.flat);
    gl.uniformMatrix4fv(at(this.flat, "view"), false, matrix);
    gl.uniform3fv(at(this.flat, "corner"), corners.flat());
    gl.bindTexture(gl.TEXTURE_2D, this.pictures[row] ?? this.empty);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);

    const tip = world(cx, cy, 0), [a, b, c, d] = corners;
    const edges = [[tip, a], [tip, b], [tip, c], [tip, d], [a, b], [b, d], [d, c], [c, a]];
    const ink = getComputedStyle(this.canvas).color.match(/[\d.]+/g).slice(0, 3).map(v => v / 255);
    gl.useProgram(this.solid);
    gl.uniform1f(at(this.solid, "shine"), 0);
    gl.uniform3fv(at(this.solid, "low"), [0, 0, 0]);
    gl.uniform3fv(at(this.solid, "step"), [1, 1, 1]);
    gl.vertexAttrib3fv(1, ink);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.lines);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(edges.flatMap(edge => this.band(...edge))), gl.DYNAMIC_DRAW);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 0, 0);
    gl.drawArrays(gl.TRIANGLES, 0, 6 * edges.length);
    gl.disableVertexAttribArray(0);
    return this.placeName(row, tip, matrix);
  }

  band(from, to) {
    const {eye} = this.camera();
    const pixel = this.pixel();
    const beside = unit(cross(add(to, from, -1), add(eye, from, -1)));
    const [p, q, r, s] = [[from, 1], [from, -1], [to, 1], [to, -1]].map(([point, sign]) =>
      add(point, beside, sign * LINE_PX / 2 * pixel * Math.hypot(...add(eye, point, -1))));
    return [...p, ...q, ...r, ...q, ...r, ...s];
  }

  placeName(row, tip, matrix) {
    const [x, y, , w] = [0, 1, 2, 3].map(i => dot([matrix[i], matrix[i + 4], matrix[i + 8], matrix[i + 12]], [...tip, 1]));
    const name = this.names[row];
    name.hidden = w <= 0;
    name.style.left = `${50 + 50 * x / w}%`;
    name.style.top = `${50 - 50 * y / w}%`;
    return w;
  }

  // Of names that would cover each other show the nearest to the viewer.
  thinNames(away) {
    const areas = this.names.map(name => name.getBoundingClientRect());
    const covers = (a, b) => a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
    const shown = [];
    for (const row of [...away.keys()].sort((a, b) => away[a] - away[b])) {
      const free = !shown.some(other => covers(areas[row], areas[other]));
      this.names[row].style.visibility = free ? "" : "hidden";
      if (free && away[row] > 0) shown.push(row);
    }
  }
}
