// The room in three dimensions: the mesh of a moment, and the nodes' frusta with their pictures as received.

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
const HALF_ANGLE = Math.tan(Math.PI / 8); // of the height, or of what 4:3 leaves of it
const FRUSTUM = 0.1; // its depth, of the first distance to the middle
const LINE_PX = 3;

// Small vectors; matrices are column by column, as WebGL wants them.
const add = (a, b, scale = 1) => a.map((value, i) => value + scale * b[i]);
const dot = (a, b) => a.reduce((sum, value, i) => sum + value * b[i], 0);
const cross = (a, b) => [0, 1, 2].map(i => a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3]);
const unit = a => a.map(value => value / Math.max(Math.hypot(...a), 1e-9));
const times = (a, b) => Array.from({length: 16}, (_, i) =>
  [0, 1, 2, 3].reduce((sum, k) => sum + a[(i % 4) + 4 * k] * b[k + 4 * (i >> 2)], 0));
const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

class Stage {
  constructor(element, record) {
    this.record = record;
    this.canvas = element.querySelector("canvas");
    this.names = record.nodes.map(node => {
      const name = element.querySelector("#names").appendChild(document.createElement("span"));
      name.textContent = node.name;
      return name;
    });
    this.pictures = record.nodes.map(() => null);
    this.mesh = null;
    this.meshes = new Map();
    this.look();
    this.gl = this.canvas.getContext("webgl2", {antialias: true, alpha: true, premultipliedAlpha: true});
    if (this.gl) this.prepare();
    this.listen();
    new ResizeObserver(() => this.draw()).observe(this.canvas);
  }

  // Where the view starts: the angles, the distance and the middle that a hand changes.
  look() {
    const {eye_m, middle_m, up} = this.record.view;
    const back = add(eye_m, middle_m, -1);
    this.up = up;
    this.ahead = unit(add(back, up, -dot(back, up)));
    this.side = cross(up, this.ahead);
    this.turn = 0;
    this.tilt = Math.asin(clamp(dot(unit(back), up), -1, 1));
    this.far = this.first = Math.hypot(...back);
    this.middle = middle_m;
  }

  prepare() {
    const gl = this.gl;
    const program = (vertex, fragment) => {
      const made = gl.createProgram();
      for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
        const shader = gl.createShader(kind);
        gl.shaderSource(shader, text);
        gl.compileShader(shader);
        gl.attachShader(made, shader);
      }
      gl.bindAttribLocation(made, 0, "place");
      gl.bindAttribLocation(made, 1, "color");
      gl.linkProgram(made);
      return made;
    };
    this.solid = program(VERTEX, FRAGMENT);
    this.flat = program(PICTURE_VERTEX, PICTURE_FRAGMENT);
    this.lines = gl.createBuffer();
    this.empty = this.texture(new ImageData(new Uint8ClampedArray([128, 128, 128, 255]), 1, 1));
    gl.enable(gl.DEPTH_TEST);
  }

  // The vertices, colours and triangles of a moment, kept on the graphics card for the next time.
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
    const attribute = (row, data, kind, normal, count) => {
      gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
      gl.enableVertexAttribArray(row);
      gl.vertexAttribPointer(row, count, kind, normal, 0, 0);
    };
    attribute(0, mesh.positions, gl.UNSIGNED_SHORT, false, 4);
    attribute(1, mesh.colors, gl.UNSIGNED_BYTE, true, 4);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, mesh.triangles, gl.STATIC_DRAW);
    gl.bindVertexArray(null);
    return {array, count: mesh.triangles.length};
  }

  texture(image) {
    const gl = this.gl;
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, image);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
    return texture;
  }

  // Drawn at most once a frame, whoever asks.
  draw() {
    this.asked ??= requestAnimationFrame(() => {
      this.asked = null;
      this.paint();
    });
  }

  camera() {
    const ahead = add(this.ahead.map(v => v * Math.cos(this.turn)), this.side, Math.sin(this.turn));
    const back = add(ahead.map(v => v * Math.cos(this.tilt)), this.up, Math.sin(this.tilt));
    const right = unit(cross(this.up, back));
    const top = cross(back, right);
    const eye = add(this.middle, back, this.far);
    const {width, height} = this.canvas;
    const tall = Math.min(height, 0.75 * width);
    const near = this.far / 100, most = this.far * 100;
    const turn = [0, 1, 2].flatMap(i => [right[i], top[i], back[i], 0]);
    const view = [...turn, -dot(right, eye), -dot(top, eye), -dot(back, eye), 1];
    const project = new Array(16).fill(0);
    project[0] = tall / width / HALF_ANGLE;
    project[5] = tall / height / HALF_ANGLE;
    project[10] = (most + near) / (near - most);
    project[11] = -1;
    project[14] = 2 * most * near / (near - most);
    return {matrix: times(project, view), eye, right, top};
  }

  // What a pixel is wide at a distance of one.
  pixel() { return 2 * HALF_ANGLE / Math.min(this.canvas.clientHeight, 0.75 * this.canvas.clientWidth); }

  paint() {
    const gl = this.gl, ratio = Math.min(devicePixelRatio || 1, 2);
    const {clientWidth, clientHeight} = this.canvas;
    if (!gl || !clientWidth || !clientHeight) return;
    this.canvas.width = Math.round(clientWidth * ratio);
    this.canvas.height = Math.round(clientHeight * ratio);
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
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
    this.record.nodes.forEach((node, row) => this.paintNode(node, row, matrix, at));
  }

  // Lines as thin bands, since WebGL draws none that a class sees, and the picture on the frustum's plane.
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
    this.placeName(row, tip, matrix);
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
  }

  listen() {
    const canvas = this.canvas;
    gestures(canvas, {
      drag: (dx, dy, moving) => {
        if (moving) return this.move(dx, dy);
        this.turn -= dx * 0.008;
        this.tilt = clamp(this.tilt + dy * 0.008, -1.5, 1.5);
        this.draw();
      },
      zoom: factor => {
        this.far = clamp(this.far / factor, this.first / 20, this.first * 5);
        this.draw();
      },
      pan: (dx, dy) => this.move(dx, dy),
    });
    canvas.addEventListener("dblclick", () => {
      this.look();
      this.draw();
    });
  }

  move(dx, dy) {
    const {right, top} = this.camera();
    const pixel = this.pixel() * this.far;
    this.middle = add(add(this.middle, right, -dx * pixel), top, dy * pixel);
    this.draw();
  }
}

// What hands do on a canvas: one pointer drags (moving: with another button), two zoom and pan, a wheel zooms,
// and one that hardly moved has clicked.
function gestures(canvas, {drag, zoom, pan, click, hover}) {
  const down = new Map();
  let travelled = 0;
  canvas.addEventListener("pointerdown", event => {
    canvas.setPointerCapture(event.pointerId);
    if (!down.size) travelled = 0;
    down.set(event.pointerId, event);
  });
  canvas.addEventListener("pointermove", event => {
    const before = down.get(event.pointerId);
    if (!before) return hover?.(event);
    const dx = event.clientX - before.clientX, dy = event.clientY - before.clientY;
    travelled += Math.abs(dx) + Math.abs(dy);
    const other = [...down.values()].find(each => each.pointerId !== event.pointerId);
    down.set(event.pointerId, event);
    if (!other) return travelled > 4 && drag(dx, dy, event.buttons > 1 || event.shiftKey);
    const apart = each => Math.hypot(each.clientX - other.clientX, each.clientY - other.clientY);
    zoom(apart(event) / Math.max(apart(before), 1), (event.clientX + other.clientX) / 2);
    pan(dx / 2, dy / 2);
  });
  for (const kind of ["pointerup", "pointercancel"])
    canvas.addEventListener(kind, event => {
      if (kind === "pointerup" && down.size === 1 && travelled <= 4) click?.(event);
      if (down.size > 1) travelled = Infinity;
      down.delete(event.pointerId);
    });
  canvas.addEventListener("contextmenu", event => event.preventDefault());
  canvas.addEventListener("wheel", event => {
    event.preventDefault();
    zoom(Math.exp(-clamp(event.deltaY * (event.deltaMode ? 33 : 1), -200, 200) * 0.002), event.clientX);
  }, {passive: false});
}
