// The dock: buttons and a timeline in a row of their own below the picture. Its other side is dock.py.
(() => {
  if (window.packetmeshDocks?.made) return;

  const GUTTER_PX = 150; // for the names beside the lanes
  const AXIS_PX = 20; // below the lanes; a hand on it moves the clock
  const LANES_GAP_PX = 4;
  const DRAG_PX = 4; // less is a click
  const REACH_PX = 4; // how far beside an item still means it
  const AGAIN_MS = 150; // before what was not heard is said again
  const LATEST = ["look", "point", "seek"]; // of these only the last counts
  const PAGE = Math.random().toString(36).slice(2);
  const docks = new Map();

  const css = ([red, green, blue]) => `rgb(${red}, ${green}, ${blue})`;

  function make(tag, style, parent, properties = {}) {
    const element = Object.assign(document.createElement(tag), properties);
    element.style.cssText = style;
    parent?.append(element);
    return element;
  }

  // 3.21 s, 12.4 ms; of times a step apart in the unit of the largest, as many digits as tell them apart.
  function timeText(ns, step = 0, largest = 0) {
    const size = Math.max(Math.abs(ns), largest);
    const [unit, name] = size >= 1e9 ? [1e9, "s"] : size >= 1e6 ? [1e6, "ms"] : [1e3, "µs"];
    const value = ns / unit;
    const digits = step > 0
      ? Math.min(Math.max(Math.ceil(-Math.log10(step / unit) - 1e-9), 0), 9)
      : Math.abs(value) >= 100 ? 0 : Math.abs(value) >= 10 ? 1 : 2;
    return `${value.toFixed(digits)} ${name}`;
  }

  // The page's root is a column with the picture and the control panel in its row.
  function root() {
    let found = null;
    for (let element = document.querySelector("canvas[data-engine]"); element; element = element.parentElement)
      if (element.style.flexDirection === "column" && element.style.height === "100%") found = element;
    return found;
  }

  class Dock {
    constructor(name) {
      this.name = name;
      this.start = 0;
      this.end = 1;
      this.now = 0;
      this.window = [0, 1]; // ns, of this page
      this.shown = [0, 1]; // of the pictures
      this.lanes = [];
      this.unheard = [];
      this.said = 0;
      this.playing = false;
      this.visible = false;
      this.build();
      // Without the panel through which it speaks, as when the server is gone, it is not there.
      new MutationObserver(() => this.place()).observe(document.body, {childList: true, subtree: true});
    }

    build() {
      this.row = make("div", "flex: none; border-top: 1px solid #cfd6dc; background: #fff; color: #2b3138; " +
        "font: 12px/1.3 system-ui, sans-serif; user-select: none; outline: none; position: relative; " +
        "padding: 4px 10px 2px 10px; box-sizing: border-box; overflow: hidden",
        null, {className: "packetmesh-dock-row", tabIndex: 0});
      this.row.setAttribute("role", "group");
      this.row.setAttribute("aria-label", "Timeline");
      const bar = make("div", "display: flex; flex-wrap: wrap; align-items: center; gap: 2px 6px; " +
        "min-height: 28px", this.row);
      const button = (text, title, action) => {
        const one = make("button", "flex: none; white-space: nowrap; border: 1px solid #c3cbd2; border-radius: 4px; background: #f7f9fa; " +
          "height: 24px; min-width: 28px; padding: 0 8px; font: inherit; cursor: pointer; color: inherit",
          bar, {textContent: text, title, type: "button"});
        one.setAttribute("aria-label", title.split(":")[0]);
        one.addEventListener("click", action);
        // So that keys go on to mean the same after it.
        one.addEventListener("pointerdown", () => setTimeout(() => this.row.focus({preventScroll: true})));
        return one;
      };
      button("|◀", "Event back: to the event before (left arrow)", () => this.say("step", -1));
      this.play = button("▶", "Play: or pause (space)", () => this.say("toggle"));
      button("▶|", "Next event: (right arrow)", () => this.say("step", 1));
      this.time = make("span", "font-variant-numeric: tabular-nums; font-weight: 600; min-width: 190px; " +
        "padding-left: 6px; font-size: 13px", bar, {className: "packetmesh-dock-time"});
      make("span", "color: #56606a", bar, {textContent: "Speed"});
      button("−", "Slower", () => this.say("faster", -1));
      this.speed = make("span", "min-width: 46px; text-align: center", bar, {title: "Speed"});
      button("+", "Faster", () => this.say("faster", 1));
      make("span", "color: #56606a; margin-left: 10px", bar, {textContent: "Zoom"});
      button("−", "Zoom out: (− or the wheel)", () => this.zoom(2, this.xOf(this.now)));
      button("+", "Zoom in: about the clock (+ or the wheel)", () => this.zoomClock());
      button("All", "All: show the whole run", () => this.look(this.start, this.end));
      this.legend = make("span", "display: flex; flex-wrap: wrap; gap: 0 12px; margin-left: auto", bar);
      this.body = make("div", "position: relative; display: flex", this.row);
      this.names = make("div", `flex: none; width: ${GUTTER_PX}px; position: relative`, this.body);
      this.field = make("div", "flex: 1; position: relative; overflow: hidden; cursor: crosshair; " +
        "touch-action: none", this.body, {className: "packetmesh-dock-field"});
      this.cursor = make("div", "position: absolute; top: 0; bottom: 0; width: 2px; margin-left: -1px; " +
        "background: #1b1f24; pointer-events: none; z-index: 3", this.field,
        {className: "packetmesh-dock-cursor"});
      make("div", "position: absolute; bottom: 0; left: -4px; width: 10px; height: 10px; border-radius: 5px; " +
        "background: #1b1f24", this.cursor);
      this.box = make("div", "position: absolute; border: 2px solid #111; box-shadow: 0 0 0 1px #fff; " +
        "pointer-events: none; z-index: 2; display: none; box-sizing: content-box; margin: -2px", this.field);
      make("div", `position: absolute; left: 0; right: 0; bottom: 0; height: ${AXIS_PX}px; ` +
        "cursor: ew-resize", this.field, {title: "Drag to move the clock"});
      this.axis = make("div", `position: absolute; left: 0; right: 0; bottom: 0; height: ${AXIS_PX}px; ` +
        "overflow: hidden; pointer-events: none; color: #56606a", this.field);
      this.tip = make("div", "position: fixed; z-index: 500; max-width: 420px; padding: 5px 8px; " +
        "background: #22282e; color: #fff; border-radius: 4px; pointer-events: none; display: none; " +
        "font: 12px/1.35 system-ui, sans-serif", document.body, {className: "packetmesh-dock-tip"});
      this.listen();
      new ResizeObserver(() => this.resized()).observe(this.field);
    }

    // What a hand does.

    listen() {
      const field = this.field;
      field.addEventListener("wheel", event => {
        event.preventDefault();
        event.stopPropagation();
        const sideways = Math.abs(event.deltaX) > Math.abs(event.deltaY) || event.shiftKey;
        const pixels = event.deltaMode === 1 ? 33 : 1;
        if (sideways) return this.pan((event.deltaX || event.deltaY) * pixels);
        this.zoom(Math.exp(Math.max(-300, Math.min(300, event.deltaY * pixels)) * 0.002), this.x(event));
      }, {passive: false});
      let down = null;
      field.addEventListener("pointerdown", event => {
        if (event.button !== 0) return;
        field.setPointerCapture(event.pointerId);
        const scrubs = event.clientY > field.getBoundingClientRect().bottom - AXIS_PX;
        down = {x: event.clientX, window: this.window, dragged: false, scrubs};
        if (scrubs) this.scrub(event);
        this.row.focus({preventScroll: true});
        event.preventDefault();
      });
      field.addEventListener("pointermove", event => {
        this.pointer = event;
        if (!down) return this.point(event);
        if (down.scrubs) return this.scrub(event);
        const moved = event.clientX - down.x;
        if (Math.abs(moved) >= DRAG_PX) down.dragged = true;
        if (!down.dragged) return;
        this.tip.style.display = "none";
        field.style.cursor = "grabbing";
        const ns = moved / this.width() * (down.window[1] - down.window[0]);
        this.look(down.window[0] - ns, down.window[1] - ns);
      });
      const up = event => {
        if (down && !down.dragged && !down.scrubs && event.type === "pointerup") this.click(event);
        down = null;
        field.style.cursor = "crosshair";
      };
      field.addEventListener("pointerup", up);
      field.addEventListener("pointercancel", up);
      field.addEventListener("pointerleave", () => {
        this.pointer = null;
        this.tip.style.display = "none";
      });
      this.row.addEventListener("keydown", event => {
        if (event.ctrlKey || event.metaKey || event.altKey) return;
        if (event.key === " " && event.target !== this.row) return; // a button that has the focus
        const action = {
          " ": () => this.say("toggle"),
          ArrowLeft: () => this.say("step", -1),
          ArrowRight: () => this.say("step", 1),
          Home: () => this.say("seek", this.start),
          End: () => this.say("seek", this.end),
          "+": () => this.zoomClock(),
          "-": () => this.zoom(2, this.xOf(this.now)),
        }[event.key];
        if (action === undefined) return;
        event.preventDefault();
        event.stopPropagation();
        action();
      });
    }

    width() {
      return Math.max(this.field.clientWidth, 1);
    }

    x(event) {
      return event.clientX - this.field.getBoundingClientRect().left;
    }

    xOf(ns) {
      return (ns - this.window[0]) / (this.window[1] - this.window[0]) * this.width();
    }

    at(x) {
      return this.window[0] + x / this.width() * (this.window[1] - this.window[0]);
    }

    zoom(factor, x) {
      const ns = this.at(Math.max(0, Math.min(x, this.width())));
      const [from, to] = this.window;
      const most = this.end - this.start;
      factor = Math.min(Math.max((to - from) * factor, 1000), most) / (to - from);
      this.look(ns - (ns - from) * factor, ns + (to - ns) * factor);
    }

    // In, about the clock; first to it if it is out of sight.
    zoomClock() {
      const [from, to] = this.window;
      const span = to - from;
      if (this.now < from || this.now > to) this.look(this.now - span / 2, this.now + span / 2);
      this.zoom(0.5, this.xOf(this.now));
    }

    pan(px) {
      const ns = px / this.width() * (this.window[1] - this.window[0]);
      this.look(this.window[0] + ns, this.window[1] + ns);
    }

    look(from, to) {
      const span = Math.min(to - from, this.end - this.start);
      from = Math.min(Math.max(from, this.start), this.end - span);
      this.window = [from, from + span];
      this.draw();
      this.say("look", from, from + span, this.width() * Math.min(window.devicePixelRatio, 2));
    }

    where(event) {
      const y = event.clientY - this.field.getBoundingClientRect().top;
      const lane = this.lanes.findIndex(one => y >= one.top && y < one.top + one.height);
      const reach = REACH_PX / this.width() * (this.window[1] - this.window[0]);
      return [lane, this.at(this.x(event)), lane < 0 ? 0 : y - this.lanes[lane].top, reach];
    }

    point(event) {
      this.say("point", ...this.where(event));
      this.showTip();
    }

    click(event) {
      this.say("click", ...this.where(event));
    }

    // The cursor follows the hand at once.
    scrub(event) {
      this.now = Math.min(Math.max(this.at(this.x(event)), this.start), this.end);
      this.say("seek", this.now);
      this.draw();
    }

    resized() {
      if (!this.visible) return;
      this.draw();
      this.say("look", ...this.window, this.width() * Math.min(window.devicePixelRatio, 2));
    }

    // The way to the server.

    say(name, ...values) {
      if (LATEST.includes(name)) this.unheard = this.unheard.filter(([, other]) => other !== name);
      this.unheard.push([++this.said, name, ...values]);
      this.send();
    }

    send() {
      clearTimeout(this.again);
      const input = this.anchor()?.parentElement.nextElementSibling?.querySelector("input");
      if (input && this.unheard.length) {
        this.attempt = (this.attempt ?? 0) + 1;
        const text = JSON.stringify({page: PAGE, attempt: this.attempt, actions: this.unheard});
        Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value").set.call(input, text);
        input.dispatchEvent(new Event("input", {bubbles: true}));
        this.again = setTimeout(() => this.send(), AGAIN_MS);
      }
    }

    anchor() {
      return document.querySelector(`.packetmesh-dock[data-dock="${this.name}"]`);
    }

    // What the server says.

    hear(message) {
      this[message.kind](message);
      this.place();
    }

    setup({visible, ends, window: shown, lanes}) {
      this.wanted = visible;
      [this.start, this.end] = ends;
      for (const lane of this.lanes)
        for (const part of [lane.image, lane.words, lane.veil, lane.names]) part.remove();
      let top = 0;
      this.lanes = lanes.map(lane => {
        const place = `position: absolute; top: ${top}px; height: ${lane.height}px; pointer-events: none`;
        const image = make("img", place, this.field);
        const words = make("div", `${place}; left: 0; right: 0; overflow: hidden`, this.field);
        const veil = make("div", `${place}; right: 0; background: rgba(250, 251, 252, 0.82); ` +
          `display: ${lane.grows ? "block" : "none"}`, this.field);
        const names = make("div", `${place}; left: 0; right: 6px`, this.names);
        const made = {...lane, top, image, words, veil, names, wordsSaid: []};
        top += lane.height + LANES_GAP_PX;
        return made;
      });
      this.field.style.height = this.names.style.height = `${top + AXIS_PX}px`;
      this.legend.replaceChildren(...lanes.flatMap(lane => lane.grows ? [] : lane.legend).map(([text, color]) => {
        const word = make("span", "", null, {textContent: text});
        word.prepend(make("span", "display: inline-block; width: 10px; height: 10px; border-radius: 2px; " +
          `margin-right: 5px; background: ${css(color)}`, null));
        return word;
      }));
      this.window = this.shown = shown;
    }

    // New pictures take the place of the old ones once they can be drawn at once.
    async picture({window: shown, pictures, words}) {
      const lanes = this.lanes;
      const turn = this.turn = (this.turn ?? 0) + 1;
      const images = pictures.map(src => Object.assign(new Image(), {src, alt: "", draggable: false}));
      await Promise.all(images.map(image => image.decode().catch(() => {})));
      if (turn < (this.drawnTurn ?? 0) || lanes !== this.lanes) return;
      this.drawnTurn = turn;
      this.shown = shown;
      if (!this.unheard.some(([, name]) => name === "look")) this.window = shown;
      lanes.forEach((lane, index) => {
        images[index].style.cssText = lane.image.style.cssText;
        images[index].style.imageRendering = "pixelated";
        images[index].style.maxWidth = "none";
        lane.image.replaceWith(images[index]);
        lane.image = images[index];
        lane.wordsSaid = words[index];
      });
      this.row.dataset.window = shown.join(" ");
      this.draw();
    }

    state({now, playing, speed, heard, tip, chosen, labels}) {
      this.unheard = this.unheard.filter(([number]) => number > (heard[PAGE] ?? 0));
      if (!this.unheard.length) clearTimeout(this.again);
      const moved = this.now !== now;
      Object.assign(this, {playing, tipSaid: tip, chosen});
      if (!this.unheard.some(([, name]) => name === "seek")) this.now = now; // else the hand is ahead
      this.play.textContent = playing ? "❚❚" : "▶";
      this.speed.textContent = speed;
      this.lanes.forEach((lane, index) => {
        const said = JSON.stringify(labels[index] ?? []);
        if (lane.said === said) return;
        lane.said = said;
        lane.names.replaceChildren(...(labels[index] ?? []).map(([y, text, color]) =>
          make("div", `position: absolute; right: 0; top: ${y - 8}px; line-height: 16px; white-space: nowrap; ` +
            `font-size: 11px; color: ${css(color)}`, null, {textContent: text})));
      });
      if (moved && playing) this.follow();
      this.draw();
      this.showTip();
    }

    // Turn the page when the clock leaves it.
    follow() {
      const [from, to] = this.window;
      if (this.now >= from && this.now <= to) return;
      const span = to - from;
      this.look(this.now - 0.05 * span, this.now + 0.95 * span);
    }

    draw() {
      const width = this.width();
      const scale = width / (this.window[1] - this.window[0]);
      const left = (this.shown[0] - this.window[0]) * scale;
      const cursor = this.xOf(this.now);
      for (const lane of this.lanes) {
        lane.image.style.left = `${left}px`;
        lane.image.style.width = `${(this.shown[1] - this.shown[0]) * scale}px`;
        lane.veil.style.left = `${Math.max(cursor, 0)}px`;
        this.write(lane, scale);
      }
      this.cursor.style.left = `${cursor}px`;
      const step = (this.window[1] - this.window[0]) / width;
      const now = timeText(this.now, Math.max(10 ** Math.floor(Math.log10(2 * step)), 1), this.end);
      this.time.textContent = `${now} of ${timeText(this.end)}`;
      this.drawBox(scale);
      this.drawAxis(width);
    }

    write(lane, scale) {
      lane.words.replaceChildren(...lane.wordsSaid.map(([from, to, y, text]) => {
        const [left, right] = [from, to].map(ns => (ns - this.window[0]) * scale);
        const [begin, end] = [Math.max(left, 0), Math.min(right, this.width())];
        return make("div", `position: absolute; left: ${begin}px; width: ${Math.max(end - begin, 0)}px; ` +
          `top: ${y - 8}px; line-height: 15px; font-size: 10.5px; color: #fff; text-align: center; ` +
          "overflow: hidden; white-space: nowrap", null, {textContent: text});
      }));
    }

    drawBox(scale) {
      const lane = this.lanes[this.chosen?.lane];
      this.box.style.display = lane ? "block" : "none";
      if (!lane) return;
      const [start, end, top, bottom] = this.chosen.place;
      Object.assign(this.box.style, {
        left: `${(start - this.window[0]) * scale}px`, width: `${Math.max((end - start) * scale, 2)}px`,
        top: `${lane.top + top}px`, height: `${bottom - top}px`,
      });
    }

    drawAxis(width) {
      const span = this.window[1] - this.window[0];
      const rough = span / Math.max(width / 110, 1);
      const power = 10 ** Math.floor(Math.log10(rough));
      const step = [1, 2, 5, 10].map(times => times * power).find(one => one >= rough);
      const ticks = [];
      for (let index = Math.ceil(this.window[0] / step); index * step <= this.window[1]; index++) {
        const x = this.xOf(index * step);
        const tick = make("div", `position: absolute; left: ${x}px; top: 0; height: 4px; ` +
          "border-left: 1px solid #8b959e", null);
        const word = make("div", `position: absolute; left: ${x}px; top: 4px; transform: translateX(` +
          `${x < 24 ? "0" : x > width - 24 ? "-100%" : "-50%"}); white-space: nowrap; font-size: 11px; ` +
          "line-height: 15px", null, {textContent: timeText(index * step, step, this.window[1])});
        ticks.push(tick, word);
      }
      this.axis.replaceChildren(...ticks);
    }

    showTip() {
      const text = this.tipSaid;
      this.tip.style.display = this.pointer && text ? "block" : "none";
      if (!this.pointer || !text) return;
      this.tip.textContent = text;
      const box = this.tip.getBoundingClientRect();
      this.tip.style.left = `${Math.min(this.pointer.clientX + 12, innerWidth - box.width - 4)}px`;
      this.tip.style.top = `${this.pointer.clientY - box.height - 12}px`;
    }

    place() {
      const visible = Boolean(this.wanted && this.anchor());
      if (visible === this.visible && (!visible || this.row.isConnected)) return;
      this.visible = visible;
      if (visible) root()?.append(this.row);
      else {
        this.row.remove();
        this.tip.style.display = "none";
      }
    }
  }

  const waiting = window.packetmeshDocks ?? [];
  window.packetmeshDocks = {
    made: true,
    push(message) {
      if (!docks.has(message.dock)) docks.set(message.dock, new Dock(message.dock));
      docks.get(message.dock).hear(message);
    },
  };
  waiting.forEach(message => window.packetmeshDocks.push(message));
})();
