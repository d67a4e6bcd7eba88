// The drawing of a dock: lanes, words, clock and axis of a time window. Style sheet: dock.css.
window.packetmeshDockView = (() => {
  const {DockRow, make} = window.packetmeshDockRow;
  const AXIS_PX = 20; // height of the axis below the lanes; dragging it moves the clock
  const LANES_GAP_PX = 4;

  const css = ([red, green, blue]) => `rgb(${red}, ${green}, ${blue})`;

  // Return 3.21 s, 12.4 ms. With a step: the unit of the largest time, and enough digits to show the step.
  function timeText(ns, step = 0, largest = 0) {
    const size = Math.max(Math.abs(ns), largest);
    const [unit, name] = size >= 1e9 ? [1e9, "s"] : size >= 1e6 ? [1e6, "ms"] : [1e3, "µs"];
    const value = ns / unit;
    const digits = step > 0
      ? Math.min(Math.max(Math.ceil(-Math.log10(step / unit) - 1e-9), 0), 9)
      : Math.abs(value) >= 100 ? 0 : Math.abs(value) >= 10 ? 1 : 2;
    return `${value.toFixed(digits)} ${name}`;
  }

  const COUNT_NS = 1e9; // length of an iteration or step, on an axis that counts them

  class DockView extends DockRow {
    // Return the label of a position on the axis.
    text(ns, step = 0, largest = 0) {
      return this.counts ? `${Math.floor(ns / COUNT_NS + 1e-6)}` : timeText(ns, step, largest);
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

    setLanes(lanes) {
      for (const lane of this.lanes)
        for (const part of [lane.image, lane.words, lane.veil, lane.scale, lane.names]) part.remove();
      let top = 0;
      this.lanes = lanes.map(lane => {
        const part = (tag, className, parent) => {
          const made = make(tag, className, parent);
          made.style.top = `${top}px`;
          made.style.height = `${lane.height}px`;
          return made;
        };
        const image = part("img", "", this.field);
        const words = part("div", "words", this.field);
        const veil = part("div", "veil", this.field);
        veil.style.opacity = lane.veil;
        const scale = part("div", "scale", this.field);
        for (const [y, text] of lane.ticks) make("span", "", scale, {textContent: text}).style.top = `${y - 7}px`;
        const made = {...lane, top, image, words, veil, scale, names: part("div", "", this.names), wordsSaid: []};
        top += lane.height + LANES_GAP_PX;
        return made;
      });
      this.field.style.height = this.names.style.height = `${top + AXIS_PX}px`;
      // Lanes of one kind have the same legend entries: each is shown once.
      const entries = lanes.filter(lane => !lane.veil).flatMap(lane => lane.legend);
      const legend = [...new Map(entries.map(entry => [entry.join(), entry])).values()];
      this.legend.replaceChildren(...legend.map(([text, color]) => {
        const word = make("span", "", null, {textContent: text});
        const box = make("i", "");
        box.style.background = css(color);
        word.prepend(box);
        return word;
      }));
    }

    setLabels(labels) {
      this.lanes.forEach((lane, index) => {
        const said = JSON.stringify(labels[index] ?? []);
        if (lane.said === said) return;
        lane.said = said;
        lane.names.replaceChildren(...(labels[index] ?? []).map(([y, text, color]) => {
          const word = make("div", "", null, {textContent: text});
          const dark = `color-mix(in srgb, ${css(color)} 70%, black)`; // the curve's colour, readable as a text
          Object.assign(word.style, {top: `${Math.max(y - 8, -2)}px`, color: dark});
          return word;
        }));
      });
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
      // Resolution: one pixel, and at least three digits of the end, as in tables.
      const fine = Math.max(10 ** Math.min(Math.ceil(Math.log10(step)), Math.floor(Math.log10(this.end / 100))), 1);
      const [now, end] = [this.now, this.end].map(ns => this.text(ns, fine, this.end));
      this.time.textContent = `${this.counts} ${now} of ${end}`.trim();
      this.drawBox(scale);
      this.drawAxis(width);
    }

    write(lane, scale) {
      lane.words.replaceChildren(...lane.wordsSaid.map(([from, to, y, text]) => {
        const [left, right] = [from, to].map(ns => (ns - this.window[0]) * scale);
        const [begin, end] = [Math.max(left, 0), Math.min(right, this.width())];
        const word = make("div", "", null, {textContent: text});
        const width = Math.max(end - begin, 0);
        Object.assign(word.style, {left: `${begin}px`, width: `${width}px`, top: `${y - 8}px`});
        return word;
      }));
    }

    drawBox(scale) {
      const lane = this.lanes[this.chosen?.lane];
      this.box.hidden = !lane;
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
      const round = [1, 2, 5, 10].map(times => times * power).find(one => one >= rough);
      const step = this.counts ? Math.max(round, COUNT_NS) : round;
      const ticks = [];
      for (let index = Math.ceil(this.window[0] / step); index * step <= this.window[1]; index++) {
        const x = this.xOf(index * step);
        const tick = make("i", "");
        const word = make("span", "", null, {textContent: this.text(index * step, step, this.window[1])});
        tick.style.left = word.style.left = `${x}px`;
        const back = x < 24 ? 0 : x > width - 24 ? 100 : 50; // keeps the first and the last label whole
        word.style.transform = `translateX(-${back}%)`;
        ticks.push(tick, word);
      }
      this.axis.replaceChildren(...ticks);
    }

    showTip() {
      const text = this.tipSaid;
      this.tip.hidden = !this.pointer || !text;
      if (this.tip.hidden) return;
      this.tip.textContent = text;
      const box = this.tip.getBoundingClientRect();
      this.tip.style.left = `${Math.min(this.pointer.clientX + 12, innerWidth - box.width - 4)}px`;
      this.tip.style.top = `${this.pointer.clientY - box.height - 12}px`;
    }
  }

  return {AXIS_PX, DockView};
})();
