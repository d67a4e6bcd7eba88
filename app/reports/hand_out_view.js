// A 3-D view that the user can turn: its camera, and its calls of WebGL.

const HALF_ANGLE = Math.tan(Math.PI / 8); // tangent of half the field of view: vertical, or vertical of the part that fits 4:3

// Small vectors; matrices are in column order, as WebGL takes them.
const add = (a, b, scale = 1) => a.map((value, i) => value + scale * b[i]);
const dot = (a, b) => a.reduce((sum, value, i) => sum + value * b[i], 0);
const cross = (a, b) => [0, 1, 2].map(i => a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3]);
const unit = a => a.map(value => value / Math.max(Math.hypot(...a), 1e-9));
const times = (a, b) => Array.from({length: 16}, (_, i) =>
  [0, 1, 2, 3].reduce((sum, k) => sum + a[(i % 4) + 4 * k] * b[k + 4 * (i >> 2)], 0));
const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

class View {
  // Start at {eye_m, middle_m, up}. A subclass draws in `paint` and makes its buffers once in `prepare`.
  constructor(canvas, from) {
    this.canvas = canvas;
    this.from = from;
    this.look();
    this.gl = canvas.getContext("webgl2", {antialias: true, alpha: true, premultipliedAlpha: true});
    if (this.gl) {
      this.gl.enable(this.gl.DEPTH_TEST);
      this.prepare();
    }
    this.listen();
    new ResizeObserver(() => this.draw()).observe(canvas);
  }

  // Set the first view: the angles, the distance and the middle that the user can change.
  look() {
    const {eye_m, middle_m, up} = this.from;
    const back = add(eye_m, middle_m, -1);
    this.up = up;
    this.ahead = unit(add(back, up, -dot(back, up)));
    this.side = cross(up, this.ahead);
    this.turn = 0;
    this.tilt = Math.asin(clamp(dot(unit(back), up), -1, 1));
    this.far = this.first = Math.hypot(...back);
    this.middle = middle_m;
  }

  // Compile a program; attributes are numbered in the order of their names.
  program(vertex, fragment, names) {
    const gl = this.gl, made = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(made, shader);
    }
    names.forEach((name, row) => gl.bindAttribLocation(made, row, name));
    gl.linkProgram(made);
    return made;
  }

  attribute(row, data, kind, normal, count) {
    const gl = this.gl, buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
    gl.enableVertexAttribArray(row);
    gl.vertexAttribPointer(row, count, kind, normal, 0, 0);
    return buffer;
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

  // Draw at the next frame, once for all requests.
  draw() {
    this.asked ??= requestAnimationFrame(() => {
      this.asked = null;
      this.paint();
    });
  }

  // Clear the canvas at the screen's resolution; return false if there is nothing to draw on.
  begin() {
    const gl = this.gl, ratio = Math.min(devicePixelRatio || 1, 2);
    const {clientWidth, clientHeight} = this.canvas;
    if (!gl || !clientWidth || !clientHeight) return false;
    this.canvas.width = Math.round(clientWidth * ratio);
    this.canvas.height = Math.round(clientHeight * ratio);
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    return true;
  }

  // Return the camera of the whole canvas, or of a part of it with this size.
  camera(width = this.canvas.width, height = this.canvas.height) {
    const ahead = add(this.ahead.map(v => v * Math.cos(this.turn)), this.side, Math.sin(this.turn));
    const back = add(ahead.map(v => v * Math.cos(this.tilt)), this.up, Math.sin(this.tilt));
    const right = unit(cross(this.up, back));
    const top = cross(back, right);
    const eye = add(this.middle, back, this.far);
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

  // Return the width of a pixel at distance one.
  pixel() { return 2 * HALF_ANGLE / Math.min(this.canvas.clientHeight, 0.75 * this.canvas.clientWidth); }

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

// Listen to a canvas: one pointer drags (moving: with another button), two zoom and pan, the wheel zooms, and
// a pointer that hardly moved clicks.
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
