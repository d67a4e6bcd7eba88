// The dock: buttons and a timeline in a row of their own below the picture. The server's part is dock.py.
(() => {
  const DRAG_PX = 4; // a shorter movement is a click
  const REACH_PX = 4; // distance from an item at which it is still hit
  const AGAIN_MS = 150; // delay before unacknowledged actions are sent again
  const LATEST = ["look", "point", "seek"]; // actions of which only the last counts
  const PAGE = Math.random().toString(36).slice(2);
  const docks = new Map();
  const {make, write} = window.packetmeshDockRow;
  const {AXIS_PX, DockView} = window.packetmeshDockView;

  class Dock extends DockView {
    constructor(name) {
      super(name, "Timeline");
      this.start = 0;
      this.end = 1;
      this.now = 0;
      this.window = [0, 1]; // ns, visible in this page
      this.shown = [0, 1]; // ns, of the pictures
      this.lanes = [];
      this.unheard = [];
      this.said = 0;
      this.playing = false;
      this.build();
    }

    build() {
      const bar = make("div", "bar", this.row);
      const button = (text, title, action) => {
        const [ariaLabel] = title.split(":");
        const one = make("button", "", bar, {textContent: text, title, type: "button", ariaLabel});
        one.addEventListener("click", action);
        // Keep the keyboard focus on the dock.
        one.addEventListener("pointerdown", () => setTimeout(() => this.row.focus({preventScroll: true})));
        return one;
      };
      this.back = button("|◀", "Event back: to the previous event (left arrow)", () => this.say("step", -1));
      this.play = button("▶", "Play: play or pause (space)", () => this.say("toggle"));
      this.next = button("▶|", "Next event: to the next event (right arrow)", () => this.say("step", 1));
      this.loop = button("↻", "Loop: start again at the end", () => this.say("loop"));
      this.time = make("span", "packetmesh-dock-time", bar);
      make("span", "about", bar, {textContent: "Speed"});
      button("−", "Slower", () => this.say("faster", -1));
      this.speed = make("span", "speed", bar);
      button("+", "Faster", () => this.say("faster", 1));
      make("span", "about", bar, {textContent: "Zoom"});
      button("−", "Zoom out: show a longer time (− or the wheel)", () => this.zoom(2, this.xOf(this.now)));
      button("+", "Zoom in: around the clock's time (+ or the wheel)", () => this.zoomClock());
      button("All", "All: show the whole run", () => this.look(this.start, this.end));
      this.legend = make("span", "legend", bar);
      const body = make("div", "body", this.row);
      this.names = make("div", "names", body);
      this.field = make("div", "packetmesh-dock-field", body);
      this.cursor = make("div", "packetmesh-dock-cursor", this.field);
      make("i", "", this.cursor);
      this.box = make("div", "box", this.field, {hidden: true});
      make("div", "grip", this.field, {title: "Drag to move the clock"});
      this.axis = make("div", "axis", this.field);
      this.tip = make("div", "packetmesh-dock-tip", document.body, {hidden: true});
      this.listen();
      new ResizeObserver(() => this.resized()).observe(this.field);
    }

    // Pointer, wheel and keys.

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
        this.tip.hidden = true;
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
        this.tip.hidden = true;
      });
      this.row.addEventListener("keydown", event => this.press(event));
      // After a click on the picture nothing has the focus; the arrow keys then turn the view.
      document.addEventListener("keydown", event => {
        const idle = event.target === document.body || event.target.matches?.("canvas");
        if (this.visible && idle && [" ", "Home", "End"].includes(event.key)) this.press(event, true);
      });
    }

    press(event, idle = false) {
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      if (event.key === " " && event.target !== this.row && !idle) return; // it presses the focused button
      const action = {
        " ": () => this.say("toggle"),
        ArrowLeft: () => this.say("step", -1),
        ArrowRight: () => this.say("step", 1),
        ArrowUp: () => {}, // would turn the view
        ArrowDown: () => {},
        Home: () => this.say("seek", this.start),
        End: () => this.say("seek", this.end),
        "+": () => this.zoomClock(),
        "-": () => this.zoom(2, this.xOf(this.now)),
      }[event.key];
      if (action === undefined) return;
      event.preventDefault();
      event.stopPropagation();
      action();
    }

    zoom(factor, x) {
      const ns = this.at(Math.max(0, Math.min(x, this.width())));
      const [from, to] = this.window;
      const most = this.end - this.start;
      factor = Math.min(Math.max((to - from) * factor, 1000), most) / (to - from);
      this.look(ns - (ns - from) * factor, ns + (to - ns) * factor);
    }

    // Zoom in about the clock; first move to the clock if it is out of sight.
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
      this.sayLook();
    }

    sayLook() {
      this.say("look", ...this.window, this.width() * Math.min(window.devicePixelRatio, 2));
      this.looked = this.said;
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

    // Move the clock; the cursor follows the pointer at once.
    scrub(event) {
      this.now = Math.min(Math.max(this.at(this.x(event)), this.start), this.end);
      this.say("seek", this.now);
      this.draw();
    }

    resized() {
      if (!this.visible) return;
      this.draw();
      this.sayLook();
    }

    // Messages to the server.

    say(name, ...values) {
      if (LATEST.includes(name)) this.unheard = this.unheard.filter(([, other]) => other !== name);
      this.unheard.push([++this.said, name, ...values]);
      this.send();
    }

    send() {
      clearTimeout(this.again);
      if (!this.unheard.length) return;
      this.attempt = (this.attempt ?? 0) + 1;
      const text = JSON.stringify({page: PAGE, attempt: this.attempt, actions: this.unheard});
      if (write(this.name, text)) this.again = setTimeout(() => this.send(), AGAIN_MS);
    }

    // Messages from the server.

    hear(message) {
      this[message.kind](message);
      this.place();
    }

    setup({visible, ends, window: shown, counts, lanes}) {
      this.wanted = visible;
      this.counts = counts;
      this.call(this.back, counts ? `One ${counts} back` : "Event back", "(left arrow)");
      this.call(this.next, `Next ${counts || "event"}`, "(right arrow)");
      this.speed.title = counts ? `${counts}s per second` : "Simulated seconds per second";
      [this.start, this.end] = ends;
      this.setLanes(lanes);
      this.window = this.shown = shown;
      if (this.visible) this.came();
    }

    // Replace the pictures once the new ones are decoded.
    async picture({window: shown, pictures, words, heard}) {
      const lanes = this.lanes;
      const turn = this.turn = (this.turn ?? 0) + 1;
      const images = pictures.map(src => Object.assign(new Image(), {src, alt: "", draggable: false}));
      await Promise.all(images.map(image => image.decode().catch(() => {})));
      if (turn < (this.drawnTurn ?? 0) || lanes !== this.lanes) return;
      this.drawnTurn = turn;
      this.shown = shown;
      if (!(this.looked > (heard[PAGE] ?? 0))) this.window = shown; // else the user is ahead of the server
      lanes.forEach((lane, index) => {
        images[index].style.cssText = lane.image.style.cssText;
        lane.image.replaceWith(images[index]);
        lane.image = images[index];
        lane.wordsSaid = words[index];
      });
      this.row.dataset.window = shown.join(" ");
      this.draw();
    }

    call(button, name, key) {
      Object.assign(button, {title: `${name} ${key}`, ariaLabel: name});
    }

    state({now, playing, loops, speed, heard, tip, chosen, labels}) {
      this.unheard = this.unheard.filter(([number]) => number > (heard[PAGE] ?? 0));
      if (!this.unheard.length) clearTimeout(this.again);
      const moved = this.now !== now;
      Object.assign(this, {playing, tipSaid: tip, chosen});
      if (!this.unheard.some(([, name]) => name === "seek")) this.now = now; // else the user is ahead of the server
      this.play.textContent = playing ? "❚❚" : "▶";
      this.loop.ariaPressed = loops;
      this.speed.textContent = speed;
      this.setLabels(labels);
      if (moved && playing) this.follow();
      this.draw();
      this.showTip();
    }

    // Move the window on when the clock leaves it.
    follow() {
      const [from, to] = this.window;
      if (this.now >= from && this.now <= to) return;
      const span = to - from;
      this.look(this.now - 0.05 * span, this.now + 0.95 * span);
    }

    left() {
      this.tip.hidden = true;
    }

    // Give the dock the keyboard focus when it appears, unless the user types elsewhere.
    came() {
      const used = document.activeElement;
      const typing = used?.matches("input, textarea, select, [role=slider], [contenteditable], :focus-visible");
      const chosen = used?.matches("[aria-haspopup=listbox]:not([data-expanded])"); // after a choice from a closed list
      if (!typing || chosen) this.row.focus({preventScroll: true});
    }
  }

  packetmesh.calls.dock = (_, message) => {
    if (!docks.has(message.dock)) docks.set(message.dock, new Dock(message.dock));
    docks.get(message.dock).hear(message);
  };
})();
