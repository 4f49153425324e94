// The skeleton on its floor, and the film beside it: drag or arrow keys turn the skeleton, the slider and the charts move
// both through time, and they move the cursor of every chart of time. They play by themselves, over and over, until
// somebody touches them, unless the reader's system asks for less motion.
for (const box of document.querySelectorAll(".player")) {
  const held = JSON.parse(box.dataset.held);
  const bytes = Uint8Array.from(atob(held.points), letter => letter.charCodeAt(0));
  const points = new Int16Array(bytes.buffer), missing = -32768, each = held.joints * 3;
  const canvas = box.querySelector("canvas"), pen = canvas.getContext("2d");
  const image = box.querySelector("img"), film = held.film;
  const [button, slider, pace, output] = ["button", "input", "select", "output"].map(name => box.querySelector(name));
  let frame = 0, turn = 0.6, tilt = 0.22, playing = null;

  const joint = (row, j) => {
    const at = row * each + 3 * j;
    return points[at] === missing ? null : [0, 1, 2].map(i => points[at + i] * held.step);
  };

  const seen = ([back, right, up], middle) => {
    const x = back - middle[0], y = right - middle[1];
    const away = x * Math.cos(turn) + y * Math.sin(turn), aside = x * Math.sin(turn) - y * Math.cos(turn);
    return [aside, up * Math.cos(tilt) + away * Math.sin(tilt), away * Math.cos(tilt) - up * Math.sin(tilt)];
  };

  const draw = () => {
    const style = getComputedStyle(box), ratio = window.devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    canvas.width = width * ratio; canvas.height = height * ratio;
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.lineCap = "round";
    const middle = joint(frame, held.pelvis) ?? held.middle;
    const scale = 0.72 * height / held.height, [ox, oy] = [width / 2, 0.88 * height];
    const put = point => { const [aside, up, away] = seen(point, middle); return [ox + scale * aside, oy - scale * up, away]; };
    const line = (from, to) => { pen.beginPath(); pen.moveTo(from[0], from[1]); pen.lineTo(to[0], to[1]); pen.stroke(); };
    pen.strokeStyle = style.getPropertyValue("--line"); pen.lineWidth = 1;
    const square = held.square, reach = 4 * square, [cx, cy] = [0, 1].map(i => Math.round(middle[i] / square) * square);
    for (let i = -4; i <= 4; i++) {
      line(put([cx + i * square, cy - reach, 0]), put([cx + i * square, cy + reach, 0]));
      line(put([cx - reach, cy + i * square, 0]), put([cx + reach, cy + i * square, 0]));
    }
    const bones = held.bones.map(([a, b, colour]) => [joint(frame, a), joint(frame, b), colour])
      .filter(([a, b]) => a && b).map(([a, b, colour]) => [put(a), put(b), colour]);
    bones.sort(([a, b], [c, d]) => c[2] + d[2] - a[2] - b[2]);
    pen.lineWidth = Math.max(3, 0.028 * scale * held.height);
    for (const [a, b, colour] of bones) { pen.strokeStyle = colour; line(a, b); }
    if (image) {
      const next = film.times.findIndex(at => at > held.times[frame] + 1e-3);
      const source = film.pictures[Math.max((next < 0 ? film.times.length : next) - 1, 0)];
      if (image.src !== source) image.src = source;
    }
    output.textContent = `${held.times[frame].toFixed(2)} s`;
    slider.setAttribute("aria-valuetext", output.textContent);
  };

  const go = (row, tell) => {
    frame = Math.min(Math.max(row, 0), held.times.length - 1);
    slider.value = frame;
    draw();
    if (tell) document.dispatchEvent(new CustomEvent("moment", { detail: held.times[frame] }));
  };
  const after = time => { const row = held.times.findIndex(at => at >= time); return row < 0 ? held.times.length - 1 : row; };

  const stop = () => { cancelAnimationFrame(playing); playing = null; button.textContent = "Play"; };
  const play = again => {
    if (frame === held.times.length - 1) go(0, true);
    let last = performance.now(), at = held.times[frame];
    const step = now => {
      at += (now - last) / 1000 * parseFloat(pace.value);
      last = now;
      const row = after(at);
      if (row !== frame) go(row, true);
      if (row < held.times.length - 1) playing = requestAnimationFrame(step);
      else if (again) { go(0, true); at = held.times[0]; playing = requestAnimationFrame(step); }
      else stop();
    };
    button.textContent = "Pause";
    playing = requestAnimationFrame(step);
  };
  const toggle = () => playing === null ? play(false) : stop();

  button.addEventListener("click", toggle);
  slider.addEventListener("input", () => { stop(); go(parseInt(slider.value), true); });
  document.addEventListener("moment", event => event.detail !== held.times[frame] && (stop(), go(after(event.detail - 1e-6), false)));
  document.addEventListener("focusin", event => box.contains(event.target) || stop());
  const rotate = (right, up) => {
    turn += right;
    tilt = Math.min(Math.max(tilt + up, -0.2), 1.5);
    draw();
  };
  canvas.addEventListener("pointerdown", event => canvas.setPointerCapture(event.pointerId));
  canvas.addEventListener("pointermove", event =>
    canvas.hasPointerCapture(event.pointerId) && rotate(-0.01 * event.movementX, 0.01 * event.movementY));
  canvas.addEventListener("keydown", event => {
    const by = { ArrowLeft: [0.1, 0], ArrowRight: [-0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] }[event.key];
    if (!by && event.key !== " ") return;
    event.preventDefault();
    by ? rotate(...by) : toggle();
  });
  new ResizeObserver(draw).observe(canvas);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  go(0, false);
  if (!matchMedia("(prefers-reduced-motion: reduce)").matches && !matchMedia("print").matches) play(true);
}
