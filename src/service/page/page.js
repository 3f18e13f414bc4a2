'use strict';
// Asks the service for its state a few times a second and shows it. Everything that comes from the
// service is set as text, never as HTML.
const kPeriodMs = 400;
const kTimeoutMs = 3000;
const kDeadCameraS = 1.5;
const kStaleStatusS = 3;
const kSpanS = 240;
const kColours = ['#4e79a7', '#f28e2b', '#e15759', '#76b7b2', '#59a14f', '#b07aa1', '#9c755f', '#edc948',
  '#ff9da7', '#bab0ac'];

const byId = (id) => document.getElementById(id);
const show = (id, text) => { byId(id).textContent = text; };
const style = getComputedStyle(document.documentElement);
const quiet = style.getPropertyValue('--quiet').trim();
const line = style.getPropertyValue('--line').trim();
if (window.Chart) {
  Chart.defaults.color = quiet;
  Chart.defaults.borderColor = line;
  Chart.defaults.font.family = getComputedStyle(document.body).fontFamily;
}

let since = 0;
let uptime = 0;
let joints = [];
let moments = [];
let updates = 0;

function makeChart(id, suggested) {
  if (!window.Chart) return null;
  return new Chart(byId(id), {
    type: 'line',
    data: {datasets: []},
    options: {
      animation: false, responsive: true, maintainAspectRatio: false, parsing: false, normalized: true,
      interaction: {mode: 'index', intersect: false},
      elements: {point: {radius: 0}, line: {borderWidth: 1.5}},
      scales: {
        x: {type: 'linear', min: -kSpanS, max: 0, title: {display: true, text: 'seconds ago'},
          ticks: {callback: (v) => String(Math.round(-v)), maxRotation: 0}},
        y: suggested,
      },
      plugins: {legend: {display: false}, tooltip: {enabled: false}},
    },
  });
}
const offsetChart = makeChart('offset-chart', {});
const fitChart = makeChart('fit-chart', {min: 0, suggestedMax: 1});
const overlapChart = makeChart('overlap-chart', {min: 0, max: 1});

function setHealth(level, sentence) {
  byId('health').className = level.toLowerCase();
  show('level', level);
  show('sentence', sentence);
  document.title = level + ' - Body Schema';
}

const age = (s) => (s < 10 ? s.toFixed(1) : s.toFixed(0)) + ' s';
const length = (s) => (s < 120 ? s.toFixed(0) + ' s' : s < 7200 ? (s / 60).toFixed(0) + ' min'
  : (s / 3600).toFixed(0) + ' h');

function setCameras(cameras) {
  const place = byId('cameras');
  if (place.children.length !== cameras.length) {
    place.replaceChildren(...cameras.map((camera) => {
      const figure = document.createElement('figure');
      figure.className = 'camera';
      figure.append(document.createElement('img'), document.createElement('figcaption'));
      figure.dataset.sequence = '0';
      return figure;
    }));
  }
  cameras.forEach((camera, i) => {
    const figure = place.children[i];
    const image = figure.firstChild;
    image.alt = camera.name + ' camera with predicted outlines';
    const never = camera.age_s < 0;
    const silent = never || camera.age_s > kDeadCameraS;
    figure.classList.toggle('dead', silent || camera.frozen);
    figure.classList.toggle('never', never);
    figure.lastChild.textContent = never ? camera.name + ': no picture yet'
      : silent ? camera.name + ': no picture for ' + age(camera.age_s)
        : camera.frozen ? camera.name + ': the same picture again and again, although the arm moves' : camera.name;
    if (camera.sequence !== 0 && figure.dataset.sequence !== String(camera.sequence)) {
      figure.dataset.sequence = String(camera.sequence);
      // Shown once it is there, so that the picture never flickers.
      const next = new Image();
      next.onload = () => { image.src = next.src; };
      next.src = 'camera/' + i + '.jpg?n=' + camera.sequence;
    }
  });
}

// With the hand out of view the offsets are kept, and there is nothing to fit.
const held = (m) => m.state === 'hand_not_in_view' || m.state === 'learning_background';
const fitted = (m) => !held(m) && m.contour_rms_px > 0;

function setOffsets() {
  const last = moments[moments.length - 1];
  const body = byId('offsets').tBodies[0];
  if (!last) return;
  if (body.rows.length !== joints.length) {
    body.replaceChildren(...joints.map((name, k) => {
      const row = document.createElement('tr');
      const dot = document.createElement('i');
      dot.style.background = kColours[k % kColours.length];
      const first = row.insertCell();
      first.append(dot, name);
      row.insertCell();
      row.insertCell();
      return row;
    }));
  }
  joints.forEach((name, k) => {
    body.rows[k].cells[1].textContent = last.offset_deg[k].toFixed(2) + '\u00b0';
    body.rows[k].cells[2].textContent = '\u00b1 ' + last.sd_deg[k].toFixed(2) + '\u00b0';
  });
  show('fit', fitted(last) ? last.contour_rms_px.toFixed(2) + ' px' : '-');
  show('hand', last.hand_sd_mm.toFixed(1) + ' mm');
  show('hand-note', 'hand known to' + (last.hidden ? '; ' + last.hidden : ''));
}

// What recent pictures ask for outside what is estimated.
function setFindings(findings) {
  const causes = findings.causes;
  byId('asked').classList.toggle('found', causes.some((cause) => !cause.estimated));
  byId('findings').hidden = causes.length === 0;
  show('asked-none', causes.length > 0 ? '' : findings.blocks > 0 ? 'the pictures ask for nothing else'
    : 'not enough motion seen yet');
  show('asked-from', findings.blocks > 0 ? findings.blocks + ' pieces of motion in ' + length(findings.span_s) : '');
  const cell = (row, text) => { row.insertCell().textContent = text; };
  byId('findings').tBodies[0].replaceChildren(...causes.map((cause) => {
    const row = document.createElement('tr');
    const first = row.insertCell();
    first.append(cause.sentence);
    const note = (text) => {
      const small = document.createElement('small');
      small.textContent = text;
      first.append(small);
    };
    if (cause.alike.length > 0) note('or ' + cause.alike.join(' or ') + ', which these pictures cannot tell from it');
    if (cause.estimated) note('estimated, and so taken into account');
    const each = (value) => cause.parameters.map((p) => value(p) + ' ' + p.unit).join(', ');
    cell(row, each((p) => String(Number(p.value.toPrecision(3)))));
    cell(row, each((p) => '\u00b1 ' + Number(p.stddev.toPrecision(2))));
    cell(row, cause.z.toFixed(1));
    cell(row, cause.hand_mm.toFixed(1) + ' mm');
    return row;
  }));
}

function draw(now) {
  if (!window.Chart) return;
  const x = (m) => m.at - now;
  const dashed = moments.map(held);
  const sets = [];
  joints.forEach((name, k) => {
    const colour = kColours[k % kColours.length];
    const mean = (m) => m.offset_deg[k];
    const edge = (sign) => moments.map((m) => ({x: x(m), y: held(m) ? NaN : mean(m) + sign * m.sd_deg[k]}));
    sets.push({label: name, borderColor: colour, segment: {borderDash: (s) => (dashed[s.p1DataIndex] ? [3, 4] : undefined)},
      data: moments.map((m) => ({x: x(m), y: m.state === 'learning_background' ? NaN : mean(m)}))});
    sets.push({borderWidth: 0, data: edge(1)});
    sets.push({borderWidth: 0, backgroundColor: colour + '33', fill: '-1', data: edge(-1)});
  });
  offsetChart.data.datasets = sets;
  fitChart.data.datasets = [{borderColor: kColours[0],
    data: moments.map((m) => ({x: x(m), y: fitted(m) ? m.contour_rms_px : NaN}))}];
  overlapChart.data.datasets = [{borderColor: kColours[4],
    // NaN leaves a gap: with the hand out of view there is nothing to overlap.
    data: moments.map((m) => ({x: x(m), y: !held(m) && m.likelihood > 0 ? m.likelihood : NaN}))}];
  const oldest = moments.length ? Math.min(-10, x(moments[0])) : -10;
  for (const chart of [offsetChart, fitChart, overlapChart]) {
    chart.options.scales.x.min = Math.max(-kSpanS, Math.floor(oldest / 10) * 10);
    chart.update('none');
  }
}

function take(state) {
  const s = state.status;
  if (s && s.uptime_s < uptime) {  // the service was started again
    since = 0;
    moments = [];
    uptime = 0;
    return;
  }
  const now = performance.now() / 1000;
  if (state.joints.join() !== joints.join()) {
    joints = state.joints;
    moments = moments.filter((m) => m.offset_deg.length === joints.length);
  }
  for (const m of state.history) {
    m.at = now - m.age_s;
    moments.push(m);
    since = Math.max(since, m.sequence);
  }
  moments = moments.filter((m) => now - m.at < kSpanS && m.offset_deg.length === joints.length);
  document.body.classList.toggle('empty', moments.length === 0);
  setCameras(state.cameras);
  setOffsets();
  setFindings(state.findings);
  draw(now);
  if (!s) return;
  uptime = s.uptime_s;
  if (state.status_age_s > kStaleStatusS) {
    setHealth('STALE', 'the service has not reported for ' + age(state.status_age_s));
  } else {
    setHealth(s.level, s.sentence);
  }
  show('rate', s.frame_rate_hz.toFixed(1));
  show('latency', s.frame_rate_hz > 0 ? s.latency_median_ms.toFixed(1) + ' ms' : '-');
  show('uptime', length(s.uptime_s));
  show('dropped', s.frames_dropped + ' of ' + s.frames_in);
  show('weakest', s.weakest ? 'weakest direction: ' + s.weakest : '');
  show('about', 'version ' + s.version + ', ' + s.engine + ', ' + s.particles + ' particles, ' +
    s.memory_mb.toFixed(0) + ' MB, model ' + s.model_hash + ', configuration ' + s.config_hash);
}

async function ask() {
  const stop = new AbortController();
  const timer = setTimeout(() => stop.abort(), kTimeoutMs);
  try {
    const answer = await fetch('state.json?since=' + since, {signal: stop.signal, cache: 'no-store'});
    if (!answer.ok) throw new Error('status ' + answer.status);
    take(await answer.json());
    document.body.dataset.updates = String(++updates);
  } catch (error) {
    setHealth('STALE', 'the service does not answer');
    for (const figure of document.querySelectorAll('.camera')) figure.classList.add('dead');
  }
  clearTimeout(timer);
  setTimeout(ask, kPeriodMs);
}
ask();
