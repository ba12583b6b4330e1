// The page of an arm alive: the core answers (demo.cpp as WebAssembly), this draws. Nothing is fetched.
// ARMANGLE_CORE is the core in base64, put before this text by build.py.
'use strict';

const CIRCLE_POINTS = 72, MOST_ARCS = 16;
// The legend of armangle/colours.py.
const FREE = '#A6DBA0', OBSTACLE = '#404040', LIMIT = '#D55E00';

/** The core behind two arrays of doubles; see Asked and Told of demo.cpp. */
function loadCore(code) {
  const bytes = Uint8Array.from(atob(code), letter => letter.charCodeAt(0));
  const core = new WebAssembly.Instance(new WebAssembly.Module(bytes), {}).exports;
  core._initialize();
  core.begin();
  const view = (at, count) => new Float64Array(core.memory.buffer, at, count);
  const asked = view(core.asked_numbers(), 23);
  const told = view(core.told_numbers(), 10 + 15 + 3 * CIRCLE_POINTS + 2 * (1 + 2 * MOST_ARCS));
  const arcs = at => Array.from({length: told[at]}, (_, i) => [told[at + 1 + 2 * i], told[at + 2 + 2 * i]]);
  const points = (at, count) => Array.from({length: count}, (_, i) => told.subarray(at + 3 * i, at + 3 * i + 3));
  const sentence = status => {
    const text = new Uint8Array(core.memory.buffer, core.sentence_of(status));
    return new TextDecoder().decode(text.subarray(0, text.indexOf(0)));
  };
  const firstArcs = 25 + 3 * CIRCLE_POINTS;
  return {
    asked,
    answer() {
      core.answer();
      return {
        status: told[0], psi: told[1], allowed: told[2] === 1, q: told.slice(3, 10),
        arm: points(10, 5), circle: points(25, CIRCLE_POINTS),
        within: arcs(firstArcs), clear: arcs(firstArcs + 1 + 2 * MOST_ARCS), sentence: sentence(told[0]),
      };
    },
  };
}

/** Drawing and dragging in one element. */
function armangleDemo(element, core) {
  element.innerHTML = '<canvas width="640" height="420"></canvas><canvas width="220" height="220"></canvas>' +
    '<p><label>GC <select>' + [...Array(8).keys()].map(k => `<option>${k}</option>`).join('') +
    '</select></label> <output></output></p>' +
    '<p>Drag the end effector (blue), the ball or the dial of ψ, or the background to look from elsewhere. ' +
    'Wide green is feasible, dark grey collides with the ball, and thin red is beyond a joint limit. ' +
    'The numbers come from the C++ core, compiled to WebAssembly.</p>';
  const [space, dial] = element.querySelectorAll('canvas');
  const select = element.querySelector('select'), output = element.querySelector('output');
  const eye = {turn: 0.9, tilt: 0.35, scale: 330};
  select.value = core.asked[17];
  let answer = core.answer();

  const axes = () => {
    const [s, c, t, u] = [Math.sin(eye.turn), Math.cos(eye.turn), Math.sin(eye.tilt), Math.cos(eye.tilt)];
    return {right: [-s, c, 0], up: [-c * t, -s * t, u]};
  };
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const seen = p => {
    const {right, up} = axes();
    return [space.width / 2 + eye.scale * dot(p, right), space.height - 60 - eye.scale * dot(p, up)];
  };

  function drawSpace() {
    const g = space.getContext('2d');
    g.clearRect(0, 0, space.width, space.height);
    const line = (points, style, width, close) => {
      g.beginPath();
      points.map(seen).forEach(([x, y], i) => (i ? g.lineTo(x, y) : g.moveTo(x, y)));
      if (close) g.closePath();
      g.strokeStyle = style;
      g.lineWidth = width;
      g.stroke();
    };
    const spot = (p, radius, style) => {
      g.beginPath();
      g.arc(...seen(p), radius, 0, 2 * Math.PI);
      g.fillStyle = style;
      g.fill();
    };
    line(answer.circle, LIMIT, 2, true);
    answer.circle.forEach((p, k) => {
      const psi = 2 * Math.PI * k / CIRCLE_POINTS;
      if (inside(answer.clear, psi)) spot(p, 5, FREE);
      else if (inside(answer.within, psi)) spot(p, 2, OBSTACLE);
    });
    spot(core.asked.subarray(18, 21), eye.scale * core.asked[21], 'rgba(64, 64, 64, 0.45)');
    g.lineCap = 'round';
    line(answer.arm, answer.allowed ? '#34495e' : '#b03a2e', 9, false);
    answer.arm.forEach(p => spot(p, 6, '#eceff4'));
    spot(core.asked.filter((_, i) => i === 3 || i === 7 || i === 11), 8, '#1f77b4');
  }

  function drawDial() {
    const g = dial.getContext('2d'), middle = dial.width / 2, radius = 84;
    g.clearRect(0, 0, dial.width, dial.height);
    const ring = (arcs, style, width) => arcs.forEach(([from, to]) => {
      g.beginPath();
      g.arc(middle, middle, radius, -to, -from);
      g.strokeStyle = style;
      g.lineWidth = width;
      g.stroke();
    });
    ring([[0, 2 * Math.PI]], LIMIT, 4);
    ring(answer.within, OBSTACLE, 8);
    ring(answer.clear, FREE, 16);
    g.beginPath();
    g.arc(middle + radius * Math.cos(answer.psi), middle - radius * Math.sin(answer.psi), 9, 0, 2 * Math.PI);
    g.fillStyle = '#1f77b4';
    g.fill();
    g.fillStyle = '#34495e';
    g.textAlign = 'center';
    g.fillText(`ψ ${(answer.psi * 180 / Math.PI).toFixed(1)}°`, middle, middle);
  }

  const inside = (arcs, psi) =>
    arcs.some(([from, to]) => [psi, psi - 2 * Math.PI, psi + 2 * Math.PI].some(x => x >= from && x <= to));

  function show() {
    answer = core.answer();
    drawSpace();
    drawDial();
    const degrees = Array.from(answer.q, x => (x * 180 / Math.PI).toFixed(1)).join(', ');
    output.textContent = answer.status === 0 ? `joints 1 to 7, in degrees: ${degrees}` : answer.sentence;
  }

  let waiting = false;
  const soon = () => {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => {
      waiting = false;
      show();
    });
  };

  const at = (canvas, event) => {
    const box = canvas.getBoundingClientRect();
    return [(event.clientX - box.left) * canvas.width / box.width,
      (event.clientY - box.top) * canvas.height / box.height];
  };
  const tool = () => [core.asked[3], core.asked[7], core.asked[11]];
  const ball = () => core.asked.subarray(18, 21);
  let dragged = null, last = null;
  space.onpointerdown = event => {
    last = at(space, event);
    const off = p => Math.hypot(seen(p)[0] - last[0], seen(p)[1] - last[1]);
    dragged = 'eye';
    if (off(ball()) < eye.scale * core.asked[21]) dragged = 'ball';
    if (off(tool()) < 25) dragged = 'tool';
    space.setPointerCapture(event.pointerId);
  };
  space.onpointermove = event => {
    if (!dragged) return;
    const now = at(space, event), {right, up} = axes();
    const dx = (now[0] - last[0]) / eye.scale, dy = (last[1] - now[1]) / eye.scale;
    last = now;
    if (dragged === 'eye') {
      eye.turn -= 2 * dx;
      eye.tilt = Math.min(1.5, Math.max(-0.2, eye.tilt - 2 * dy));
    } else {
      const places = dragged === 'tool' ? [3, 7, 11] : [18, 19, 20];
      places.forEach((place, k) => (core.asked[place] += dx * right[k] + dy * up[k]));
      core.asked[16] = answer.psi;
    }
    soon();
  };
  space.onpointerup = () => (dragged = null);
  dial.onpointerdown = dial.onpointermove = event => {
    if (event.type === 'pointermove' && !event.buttons) return;
    const [x, y] = at(dial, event);
    core.asked[16] = Math.atan2(dial.height / 2 - y, x - dial.width / 2);
    soon();
  };
  select.onchange = () => {
    core.asked[17] = Number(select.value);
    soon();
  };
  show();
  return {core, show, seen, tool, answer: () => answer};
}

const armangleHere = document.getElementById('armangle-demo');
if (armangleHere) window.armangle = armangleDemo(armangleHere, loadCore(ARMANGLE_CORE));
