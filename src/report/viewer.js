// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Shows the points in the elements "node-0", "node-1", ... with three.js; PointViewer packs them.
// <html data-viewed="N"> counts the points of the first picture; <section data-settled>: the
// picture is complete. window.risleyViewer is for tests.
(function () {
  'use strict';
  const page = document.documentElement;
  const stage = document.getElementById('viewer');
  const part = (name) => document.getElementById('viewer-' + name);
  const canvas = part('points');
  const data = JSON.parse(part('data').textContent);
  const { Vector3 } = THREE;

  const fieldOfView = 50; // degrees, from top to bottom
  const finest = 1.5; // pixels between the points of drawn nodes
  const mostAtRest = 6e6, leastMoving = 1e5; // points drawn at once
  const smooth = 45; // most ms of a frame while the view moves
  const pause = 200; // ms after which a view no longer moves
  const unpackers = 4; // nodes at a time
  const reach = 10; // pixels from the mouse to a point
  const nearby = 0.03; // of the distance: points behind the first that a click may still select
  const turnStep = Math.PI / 18, moveStep = 0.1, zoomStep = 0.8;
  const mostElevation = (89.9 * Math.PI) / 180;

  // ---- words ----

  const grouped = (text) => {
    const [whole, rest] = text.replace('-', '−').split('.');
    return whole.replace(/(?<=\d)(?=(\d{3})+$)/g, '\u202f') + (rest ? '.' + rest : '');
  };
  const fixed = (value, digits) => grouped((Number(value.toFixed(digits)) || 0).toFixed(digits));
  const signed = (value) => (value >= 0 ? '+' : '') + fixed(value, 3);
  const digitsOf = (step) => Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  // The round number not below a value.
  const round = (value) => {
    const unit = 10 ** Math.floor(Math.log10(value));
    return [1, 2, 5, 10].find((k) => k * unit >= value * 0.999) * unit;
  };
  // Round numbers in a range, at most this many.
  const ticks = ([from, to], most) => {
    const step = round((to - from) / most), digits = digitsOf(step), list = [];
    for (let k = Math.ceil(from / step - 1e-6); k * step <= to + 1e-6 * step; ++k) {
      list.push([k * step, fixed(k * step, digits)]);
    }
    return list;
  };
  const metres = (value) => (value < 1 ? fixed(1000 * value, 0) + ' mm' : fixed(value, 3) + ' m');
  // Coordinates of the cloud.
  const coordinates = (at) => at.toArray().map((value, axis) => value + data.offset_m[axis]);
  const placeText = (at) => coordinates(at).map((value, axis) =>
    data.axes[axis] + ' ' + fixed(value, 3)).join(', ') + ' m';

  // ---- colours ----

  const named = (name) => getComputedStyle(page).getPropertyValue('--' + name).trim();
  const palettes = {
    sequential: () => named('sequential').split(' '),
    diverging: () => ['low', 'low-half', 'middle', 'high-half', 'high'].map(named),
  };
  const colourings = data.colourings.map((one, channel) => ({ ...one, channel }));
  colourings.splice(data.height_at, 0, data.height); // for points without a code
  let colouring = colourings[0];

  const nameAndUnit = ({ label }) => {
    const comma = label.lastIndexOf(', ');
    return comma < 0 ? [label, ''] : [label.slice(0, comma), ' ' + label.slice(comma + 2)];
  };
  function valueText(one, code) {
    if (code === 255) return 'not known';
    const [from, to] = one.range, step = (to - from) / 254;
    const text = fixed(from + code * step, digitsOf(step));
    return (code === 0 ? '≤ ' : code === 254 ? '≥ ' : '') + text + nameAndUnit(one)[1];
  }
  const valuesText = (codes) => colourings.filter((one) => one.channel !== undefined)
    .map((one) => nameAndUnit(one)[0] + ' ' + valueText(one, codes[one.channel])).join(', ');

  // 256 colours from end to end, and one for unknown values.
  const ramp = new THREE.DataTexture(new Uint8Array(4 * 257), 257, 1);
  const parts = (colour) => new THREE.Color().setStyle(colour, THREE.LinearSRGBColorSpace).toArray();
  function paintRamp() {
    const stops = palettes[colouring.palette]().map(parts), colours = ramp.image.data;
    for (let i = 0; i < 256; ++i) {
      const at = (i / 255) * (stops.length - 1), k = Math.min(Math.floor(at), stops.length - 2);
      for (let j = 0; j < 3; ++j) {
        colours[4 * i + j] = 255 * (stops[k][j] + (at - k) * (stops[k + 1][j] - stops[k][j])) + 0.5;
      }
      colours[4 * i + 3] = 255;
    }
    parts(named('muted')).forEach((value, j) => { colours[4 * 256 + j] = 255 * value; });
    colours[4 * 256 + 3] = 255;
    ramp.needsUpdate = true;
  }
  const cssColour = (i) => 'rgb(' + ramp.image.data.slice(4 * i, 4 * i + 3).join() + ')';
  // Place on the ramp of a point with these codes and this height.
  function shade(codes, height) {
    if (colouring.channel !== undefined) {
      const code = codes[colouring.channel];
      return code === 255 ? 256 : Math.round((code * 255) / 254);
    }
    const [from, to] = colouring.range;
    const share = (height + data.offset_m[2] - from) / (to - from);
    return Math.round(255 * Math.min(Math.max(share, 0), 1));
  }

  function showLegend() {
    const stops = palettes[colouring.palette]();
    part('bar').style.background = 'linear-gradient(to top, ' + stops.join() + ')';
    const [from, to] = colouring.range;
    part('name').textContent = nameAndUnit(colouring)[0];
    part('ticks').replaceChildren(...ticks(colouring.range, 6).map(([value, text]) => {
      const mark = document.createElement('span');
      mark.textContent = text + nameAndUnit(colouring)[1];
      mark.style.bottom = (100 * (value - from)) / (to - from) + '%';
      return mark;
    }));
    part('unknown').hidden = !colouring.unknown;
  }

  // ---- nodes ----

  const size = 2 ** data.bits * data.step_m; // of the whole cube, m
  const nodes = [];
  data.parents.forEach((parent, i) => {
    const octant = data.octants[i], above = i > 0 ? nodes[parent] : null;
    const edge = above ? above.edge / 2 : size;
    const corner = above ? above.corner.clone() : new Vector3(...data.corner_m);
    if (above) corner.add(new Vector3(octant >> 2 & 1, octant >> 1 & 1, octant & 1).multiplyScalar(edge));
    nodes.push({
      edge, corner, middle: corner.clone().addScalar(edge / 2), count: data.counts[i],
      box: new THREE.Box3(corner, corner.clone().addScalar(edge)), points: null, loading: null, need: 0,
    });
  });

  function fromBase64(text) {
    if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
    const letters = atob(text), bytes = new Uint8Array(letters.length);
    for (let i = 0; i < bytes.length; ++i) bytes[i] = letters.charCodeAt(i);
    return bytes;
  }

  // The element of a node, once the browser has read it completely.
  function elementOf(i) {
    const element = document.getElementById('node-' + i);
    return element && (element.nextElementSibling || document.readyState !== 'loading') ? element : null;
  }

  async function unpack(node, element) {
    const packed = new Blob([fromBase64(element.textContent)]);
    element.remove();
    const stream = packed.stream().pipeThrough(new DecompressionStream('deflate'));
    const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
    const n = node.count, places = new Float32Array(3 * n), codes = new Uint8Array(4 * n);
    for (let axis = 0; axis < 3; ++axis) {
      const low = 3 * axis * n, middle = low + n, high = middle + n;
      for (let i = 0, at = 0; i < n; ++i) {
        const zigzag = bytes[low + i] | bytes[middle + i] << 8 | bytes[high + i] << 16;
        at += zigzag >>> 1 ^ -(zigzag & 1);
        places[3 * i + axis] = at * data.step_m;
      }
    }
    data.colourings.forEach((_, k) => {
      const begin = (9 + k) * n;
      for (let i = 0, code = 0; i < n; ++i) codes[4 * i + k] = code += bytes[begin + i];
    });
    node.places = places;
    node.codes = codes;
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.BufferAttribute(places, 3));
    geometry.setAttribute('code', new THREE.BufferAttribute(codes, 4));
    const points = new THREE.Points(geometry, material);
    points.position.copy(node.corner);
    points.updateMatrix();
    points.matrixAutoUpdate = points.frustumCulled = points.visible = false;
    scene.add(points);
    node.points = points;
  }

  // A promise of a node's points; null while the browser has not read them.
  function load(i) {
    const node = nodes[i];
    if (!node.loading) {
      const element = elementOf(i);
      if (element) node.loading = unpack(node, element);
    }
    return node.loading;
  }

  // ---- picture ----

  let renderer;
  try {
    renderer = new THREE.WebGLRenderer({ canvas, alpha: true, antialias: false });
  } catch (error) {
    part('words').textContent = 'The points need WebGL, which this browser does not offer.';
    stage.style.height = stage.style.minHeight = '8rem';
    part('title').textContent = document.title;
    for (const one of stage.children) one.toggleAttribute('hidden', one.id !== 'viewer-about');
    return;
  }
  renderer.setClearColor(0, 0);
  const scene = new THREE.Scene();
  scene.matrixWorldAutoUpdate = true;
  const camera = new THREE.PerspectiveCamera(fieldOfView);
  camera.up.set(0, 0, 1);
  const look = { // how points are drawn
    pick: { value: new THREE.Vector4() }, height: { value: new THREE.Vector2() },
    byHeight: { value: false }, size: { value: 2 }, dot: { value: data.dot_m }, scale: { value: 1 },
    ramp: { value: ramp },
  };
  const material = new THREE.ShaderMaterial({
    uniforms: look, glslVersion: THREE.GLSL3,
    vertexShader: `
      in vec4 code;
      uniform vec4 pick;
      uniform vec2 height;
      uniform bool byHeight;
      uniform float size, dot, scale;
      flat out float shade;
      flat out float width;
      void main() {
        gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
        float value = code.x * pick.x + code.y * pick.y + code.z * pick.z + code.w * pick.w;
        float up = (modelMatrix * vec4(position, 1.0)).z;
        shade = byHeight ? clamp((up - height.x) * height.y, 0.0, 1.0) * 255.0
                         : value > 254.5 ? 256.0 : value * 255.0 / 254.0;
        gl_PointSize = width = max(size, dot * scale / gl_Position.w);
      }`,
    fragmentShader: `
      uniform sampler2D ramp;
      flat in float shade;
      flat in float width;
      out vec4 colour;
      void main() {
        if (width > 3.5 && length(gl_PointCoord - 0.5) > 0.5) discard;
        colour = texelFetch(ramp, ivec2(shade + 0.5, 0), 0);
      }`,
  });

  // Edges in front of distant objects are darker [Boucheny 2009: eye-dome lighting].
  const screen = new THREE.WebGLRenderTarget(1, 1, {
    minFilter: THREE.NearestFilter, magFilter: THREE.NearestFilter,
    depthTexture: new THREE.DepthTexture(1, 1, THREE.UnsignedIntType),
  });
  const shading = new THREE.ShaderMaterial({
    glslVersion: THREE.GLSL3, depthTest: false, depthWrite: false,
    uniforms: {
      colours: { value: screen.texture }, depths: { value: screen.depthTexture },
      range: { value: new THREE.Vector2() }, step: { value: 1 },
    },
    vertexShader: 'void main() { gl_Position = vec4(position.xy, 0.0, 1.0); }',
    fragmentShader: `
      uniform sampler2D colours;
      uniform highp sampler2D depths;
      uniform vec2 range;
      uniform int step;
      out vec4 colour;
      float depth(ivec2 at) {
        float d = texelFetch(depths, clamp(at, ivec2(0), textureSize(depths, 0) - 1), 0).r;
        return d == 1.0 ? 0.0 : -log2(range.x * range.y / (range.y - d * (range.y - range.x)));
      }
      void main() {
        ivec2 at = ivec2(gl_FragCoord.xy);
        colour = texelFetch(colours, at, 0);
        if (colour.a == 0.0) return;
        float own = depth(at), hidden = 0.0;
        for (int k = 0; k < 4; ++k) {
          ivec2 way = step * ivec2(k == 0 ? 1 : k == 1 ? -1 : 0, k == 2 ? 1 : k == 3 ? -1 : 0);
          float other = depth(at + way);
          if (other != 0.0) hidden += clamp(other - own, 0.0, 0.1);
        }
        colour.rgb *= exp(-4.0 * hidden);
      }`,
  });
  const sheet = new THREE.Scene(), flat = new THREE.Camera();
  const cover = new THREE.BufferGeometry();
  cover.setAttribute('position', new THREE.BufferAttribute(new Float32Array([-1, -1, 0, 3, -1, 0, -1, 3, 0]), 3));
  const coverMesh = new THREE.Mesh(cover, shading);
  coverMesh.frustumCulled = false;
  sheet.add(coverMesh);

  // The camera: its distance from the centre of rotation; angles in rad.
  const middle = new Vector3(...data.middle_m);
  const view = { target: middle.clone(), azimuth: 0, elevation: 0, distance: 1 };
  const frame = { width: 0, height: 0, ratio: 1 }; // CSS pixels
  const pixelAt = (distance) => (2 * distance * Math.tan((fieldOfView * Math.PI) / 360)) / frame.height; // m

  function showWhole(azimuth = -0.75 * Math.PI, elevation = 0.42) {
    const half = Math.tan((fieldOfView * Math.PI) / 360) * Math.min(1, frame.width / frame.height || 1);
    view.target.copy(middle);
    Object.assign(view, { azimuth, elevation, distance: (0.95 * Math.max(data.radius_m, 0.01)) / half });
    moved();
  }

  function placeCamera() {
    const { target, azimuth, elevation, distance } = view, flatPart = Math.cos(elevation);
    camera.position.set(flatPart * Math.cos(azimuth), flatPart * Math.sin(azimuth), Math.sin(elevation))
      .multiplyScalar(distance).add(target);
    camera.near = distance / 200;
    camera.far = distance + camera.position.distanceTo(nodes[0].middle) + 2 * size;
    camera.lookAt(target);
    camera.updateProjectionMatrix();
    camera.updateMatrixWorld();
  }

  let movingPoints = 5e5, movedAt = -Infinity, asked = false, later = 0;
  let painting = false, cost = 0; // ms of the last picture
  const seen = new THREE.Frustum(), matrix = new THREE.Matrix4();
  let drawn = []; // nodes of the picture
  let firstPicture = null;

  function ask() {
    if (asked) return;
    asked = true;
    if (!painting) requestAnimationFrame(draw);
  }
  function askLater(milliseconds) {
    clearTimeout(later);
    later = setTimeout(ask, milliseconds);
  }
  function moved() {
    movedAt = performance.now();
    delete stage.dataset.settled;
    ask();
  }

  // Nodes needed for a picture of this many points, those that are largest on the screen first.
  function choose(most) {
    matrix.multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse);
    seen.setFromProjectionMatrix(matrix);
    const chosen = [];
    nodes.forEach((node, i) => {
      const distance = Math.max(node.box.distanceToPoint(camera.position), camera.near);
      const gap = node.edge / data.grid / pixelAt(distance); // pixels between points
      node.need = i === 0 ? Infinity : gap;
      if ((i === 0 || 2 * gap > finest) && seen.intersectsBox(node.box)) chosen.push(i);
    });
    chosen.sort((a, b) => nodes[b].need - nodes[a].need || a - b);
    let points = 0;
    return chosen.filter((i) => (points += nodes[i].count) <= most || i === 0);
  }

  let busy = 0, again = 0;
  function loadMissing(missing) {
    let unread = false;
    for (const i of missing) {
      if (busy >= unpackers) break;
      if (nodes[i].loading) continue;
      const loading = load(i);
      if (!loading) {
        unread = true;
        continue;
      }
      ++busy;
      loading.then(() => {
        --busy;
        fill();
      });
    }
    clearTimeout(again);
    if (unread) again = setTimeout(fill, 50);
  }
  // Continues loading, and shows new points now and then.
  let wanted = [], shownAt = 0;
  function fill() {
    wanted = wanted.filter((i) => !nodes[i].points);
    loadMissing(wanted);
    const since = performance.now() - shownAt;
    if (wanted.length === 0 || firstPicture === null || since > Math.max(400, 10 * cost)) ask();
  }

  function draw(now) {
    if (frame.width === 0) {
      asked = false;
      return;
    }
    const moving = now - movedAt < pause;
    placeCamera();
    const chosen = choose(moving ? movingPoints : mostAtRest);
    for (const i of drawn) if (nodes[i].points) nodes[i].points.visible = false;
    drawn = chosen.filter((i) => nodes[i].points);
    for (const i of drawn) nodes[i].points.visible = true;
    asked = false;
    render();
    showMarks();
    wanted = chosen.filter((i) => !nodes[i].points);
    loadMissing(wanted);
    const settled = !moving && wanted.length === 0;
    whenPainted((took) => {
      cost = took;
      shownAt = performance.now();
      if (moving && drawnPoints() > 0.7 * movingPoints || cost > smooth) {
        const change = Math.min(Math.max(smooth / Math.max(cost, 1), 0.6), 1.25);
        movingPoints = Math.min(Math.max(change * movingPoints, leastMoving), mostAtRest);
      }
      if (firstPicture === null && drawn.length > 0) {
        firstPicture = shownAt;
        page.dataset.viewed = String(drawnPoints());
      }
      if (asked) requestAnimationFrame(draw);
      else if (moving) askLater(pause);
      else if (settled) stage.dataset.settled = '1';
    });
  }

  // Calls back when the picture is ready, with the milliseconds taken.
  function whenPainted(done) {
    const gl = renderer.getContext(), begin = performance.now();
    const fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
    painting = true;
    const look = () => {
      if (fence && gl.clientWaitSync(fence, 0, 0) === gl.TIMEOUT_EXPIRED) return setTimeout(look, 4);
      if (fence) gl.deleteSync(fence);
      painting = false;
      done(performance.now() - begin);
    };
    setTimeout(look);
  }
  const drawnPoints = () => drawn.reduce((sum, i) => sum + nodes[i].count, 0);

  function render() {
    look.scale.value = (frame.ratio * frame.height) / (2 * Math.tan((fieldOfView * Math.PI) / 360));
    shading.uniforms.range.value.set(camera.near, camera.far);
    shading.uniforms.step.value = Math.max(1, Math.round(frame.ratio));
    renderer.setRenderTarget(screen);
    renderer.clear();
    renderer.render(scene, camera);
    renderer.setRenderTarget(null);
    renderer.render(sheet, flat);
  }

  function colour() {
    const { channel, range } = colouring;
    look.pick.value.set(...[0, 1, 2, 3].map((k) => (k === channel ? 1 : 0)));
    look.byHeight.value = channel === undefined;
    if (channel === undefined) look.height.value.set(range[0] - data.offset_m[2], 1 / (range[1] - range[0]));
    paintRamp();
    showLegend();
    ask();
    if (section) drawSection();
  }

  let pointSize = 2;
  function resizePoints(by) {
    pointSize = Math.min(Math.max(pointSize + by, 1), 10);
    look.size.value = pointSize * frame.ratio;
    ask();
  }

  // ---- points under the mouse ----

  const ray = new THREE.Raycaster();
  // The point at a pixel, or nothing: of those near it the ones in front, and of these the nearest.
  function pointAt(x, y) {
    placeCamera();
    ray.setFromCamera(new THREE.Vector2((2 * x) / frame.width - 1, 1 - (2 * y) / frame.height), camera);
    const { origin, direction: d } = ray.ray, slope = reach * pixelAt(1);
    const found = [], offset = new Vector3();
    let first = Infinity;
    for (const i of drawn) {
      const node = nodes[i], radius = 0.87 * node.edge;
      const along = offset.subVectors(node.middle, origin).dot(d);
      if (along < -radius || offset.addScaledVector(d, -along).length() > radius + slope * (along + radius)) continue;
      const from = offset.subVectors(node.corner, origin), { places } = node;
      for (let k = 0; k < places.length; k += 3) {
        const px = places[k] + from.x, py = places[k + 1] + from.y, pz = places[k + 2] + from.z;
        const t = px * d.x + py * d.y + pz * d.z;
        if (t < camera.near) continue;
        const beside = px * px + py * py + pz * pz - t * t;
        const most = slope * t;
        if (beside > most * most) continue;
        first = Math.min(first, t);
        found.push([node, k / 3, t, beside / (t * t)]);
      }
    }
    let best = null;
    for (const one of found) {
      if (one[2] <= first * (1 + nearby) && (!best || one[3] < best[3])) best = one;
    }
    return best && pointOf(best[0], best[1]);
  }
  const pointOf = (node, k) => ({
    at: new Vector3().fromArray(node.places, 3 * k).add(node.corner), codes: [...node.codes.slice(4 * k, 4 * k + 4)],
  });
  function project(at) {
    const v = at.clone().project(camera);
    return { x: (0.5 + v.x / 2) * frame.width, y: (0.5 - v.y / 2) * frame.height, behind: v.z > 1 };
  }

  // ---- tools ----

  let tool = null, ends = [], hovered = null, section = null;

  function useTool(name) {
    tool = tool === name ? null : name;
    ends = [];
    closeSection();
    if (tool) stage.dataset.tool = tool;
    else delete stage.dataset.tool;
    for (const one of ['distance', 'profile']) button(one).setAttribute('aria-pressed', String(tool === one));
    read();
    ask();
  }
  const button = (name) => part('tools').querySelector('[data-does=' + name + ']');

  function click(x, y) {
    const point = pointAt(x, y);
    if (!tool || !point) return;
    if (ends.length === 2) {
      ends = [];
      closeSection();
    }
    ends.push(point);
    if (tool === 'profile' && ends.length === 2) cut();
    read();
    ask();
  }

  function distanceText() {
    const [a, b] = ends, way = new Vector3().subVectors(b.at, a.at);
    const along = way.toArray().map((value, axis) => data.axes[axis] + ' ' + signed(value));
    return 'Distance ' + metres(way.length()) + ', horizontal ' + metres(Math.hypot(way.x, way.y)) + '\n' +
      along.join(', ') + ' m\nfrom ' + placeText(a.at) + '\nto ' + placeText(b.at);
  }

  // What the status says.
  function read() {
    let text = '';
    if (tool === 'distance' && ends.length === 2) text = distanceText();
    else if (tool && ends.length < 2) {
      text = (ends.length === 0 ? 'Click the first point' : 'Click the second point') +
        (tool === 'distance' ? ' of the distance.' : ' of the line of the profile.');
      if (hovered) text += '\n' + placeText(hovered.at);
    } else if (hovered && !section) text = placeText(hovered.at) + '\n' + valuesText(hovered.codes);
    if (part('reading').textContent !== text) part('reading').textContent = text;
  }

  const svg = (name, attributes, text = '') => {
    const element = document.createElementNS('http://www.w3.org/2000/svg', name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    element.textContent = text;
    return element;
  };
  const segment = (a, b, kind) => svg('line', { x1: a.x, y1: a.y, x2: b.x, y2: b.y, class: kind });

  function showMarks() {
    const marks = [], at = ends.map((one) => project(one.at));
    if (section) {
      const corners = section.corners.map(project);
      if (!corners.some((one) => one.behind)) {
        marks.push(svg('polygon', { points: corners.map((one) => one.x + ',' + one.y).join(' ') }));
      }
    }
    if (at.length === 2 && !at[0].behind && !at[1].behind) {
      marks.push(segment(at[0], at[1], 'halo'), segment(at[0], at[1], ''));
      const length = metres(ends[0].at.distanceTo(ends[1].at));
      if (tool === 'distance') {
        marks.push(svg('text', { x: (at[0].x + at[1].x) / 2, y: (at[0].y + at[1].y) / 2 - 10 }, length));
      }
    }
    for (const one of at) if (!one.behind) marks.push(svg('circle', { cx: one.x, cy: one.y, r: 5 }));
    part('marks').replaceChildren(...marks);
    // Directions of the axes, those pointing away first.
    const turn = camera.matrixWorldInverse;
    const ways = [0, 1, 2].map((axis) => {
      const way = new Vector3().setComponent(axis, 1).transformDirection(turn);
      return { x: 30 * way.x, y: -30 * way.y, z: way.z, name: data.axes[axis] };
    }).sort((a, b) => a.z - b.z);
    part('axes').replaceChildren(...ways.flatMap(({ x, y, name }) => [
      segment({ x: 0, y: 0 }, { x, y }, ''),
      svg('text', { x: x + 13 * Math.sign(x) * Math.min(1, Math.abs(x) / 15), y: y + 12 * Math.sign(y || 1) * Math.min(1, Math.abs(y) / 10 + 0.3) }, name),
    ]));
    const metre = 1 / pixelAt(view.distance), length = round(70 / metre);
    part('ruler').style.width = length * metre + 'px';
    part('length').textContent = length >= 1 ? fixed(length, 0) + ' m' : length >= 0.01
      ? fixed(100 * length, 0) + ' cm' : fixed(1000 * length, digitsOf(1000 * length)) + ' mm';
  }

  // ---- profile ----

  function closeSection() {
    section = null;
    part('profile').hidden = true;
  }

  // Cuts the cloud along the line between both ends, vertically, and draws the points of the slice.
  async function cut(width) {
    const [a, b] = ends.map((one) => one.at), way = new Vector3(b.x - a.x, b.y - a.y, 0);
    const length = Math.max(way.length(), 1e-3);
    way.divideScalar(length);
    const beside = new Vector3(-way.y, way.x, 0), wide = width || round(length / 100);
    const corner = (along, aside, height) => new Vector3(a.x, a.y, height)
      .addScaledVector(way, along).addScaledVector(beside, aside);
    const own = section = {
      length, wide, along: [], height: [], codes: [], whole: false,
      corners: [[0, -1, a.z], [length, -1, b.z], [length, 1, b.z], [0, 1, a.z]]
        .map(([s, k, height]) => corner(s, 0.5 * k * wide, height)),
    };
    part('profile').hidden = false;
    part('width').value = wide;
    const inside = nodes.map((_, i) => i).filter((i) => {
      const { middle, edge } = nodes[i], radius = 0.71 * edge;
      const s = (middle.x - a.x) * way.x + (middle.y - a.y) * way.y;
      const t = (middle.x - a.x) * beside.x + (middle.y - a.y) * beside.y;
      return s > -radius && s < length + radius && Math.abs(t) < wide / 2 + radius;
    });
    let shown = performance.now();
    for (const i of inside) {
      while (!load(i)) await new Promise((done) => setTimeout(done, 50));
      await nodes[i].loading;
      if (section !== own) return;
      const { places, codes, corner: from } = nodes[i];
      const x0 = from.x - a.x, y0 = from.y - a.y;
      for (let k = 0; k < places.length; k += 3) {
        const x = places[k] + x0, y = places[k + 1] + y0;
        const s = x * way.x + y * way.y;
        if (s < 0 || s > length || Math.abs(x * beside.x + y * beside.y) > wide / 2) continue;
        own.along.push(s);
        own.height.push(places[k + 2] + from.z);
        const c = (4 * k) / 3;
        own.codes.push(codes[c] | codes[c + 1] << 8 | codes[c + 2] << 16 | codes[c + 3] << 24);
      }
      if (performance.now() - shown < 250) continue;
      drawSection();
      await new Promise((done) => setTimeout(done)); // the page stays alive
      if (section !== own) return;
      shown = performance.now();
    }
    own.whole = true;
    drawSection();
    ask();
  }

  const codesOf = (packed) => [0, 8, 16, 24].map((bit) => packed >>> bit & 255);

  function drawSection() {
    const { along, height, codes, length, wide, whole } = section;
    const sheet = part('profile-points'), ratio = window.devicePixelRatio || 1;
    const w = sheet.clientWidth, h = sheet.clientHeight;
    sheet.width = Math.round(w * ratio);
    sheet.height = Math.round(h * ratio);
    const pen = sheet.getContext('2d', { willReadFrequently: true });
    const box = { left: 62, right: 14, top: 8, bottom: 38 };
    const room = { x: w - box.left - box.right, y: h - box.top - box.bottom };
    let low = Infinity, high = -Infinity;
    for (const z of height) {
      if (z < low) low = z;
      if (z > high) high = z;
    }
    if (!(high >= low)) low = high = ends[0].at.z;
    const spare = Math.max(0.03 * (high - low), 0.01);
    low -= spare;
    high += spare;
    // Both scales alike, unless heights would hardly be visible.
    let scaleX = room.x / length, scaleY = room.y / (high - low);
    if (scaleY < 3 * scaleX) scaleX = scaleY = Math.min(scaleX, scaleY);
    const times = scaleY / scaleX;
    const up = data.offset_m[2], halfRange = room.y / scaleY / 2, centre = (low + high) / 2;
    low = centre - halfRange;
    high = centre + halfRange;
    const spareX = (room.x / scaleX - length) / 2;
    const xOf = (s) => box.left + (s + spareX) * scaleX, yOf = (z) => box.top + (high - z) * scaleY;
    Object.assign(section, { xOf, yOf });
    pen.scale(ratio, ratio);
    pen.font = '12px system-ui, sans-serif';
    pen.strokeStyle = named('grid');
    pen.fillStyle = named('muted');
    pen.beginPath();
    pen.textAlign = 'center';
    for (const [s, text] of ticks([-spareX, length + spareX], Math.max(2, room.x / 90))) {
      pen.moveTo(xOf(s), box.top);
      pen.lineTo(xOf(s), h - box.bottom);
      pen.fillText(text, xOf(s), h - box.bottom + 15);
    }
    pen.textAlign = 'right';
    for (const [z, text] of ticks([low + up, high + up], Math.max(2, room.y / 28))) {
      pen.moveTo(box.left, yOf(z - up));
      pen.lineTo(w - box.right, yOf(z - up));
      pen.fillText(text, box.left - 6, yOf(z - up) + 4);
    }
    pen.stroke();
    pen.fillStyle = named('ink');
    pen.textAlign = 'center';
    pen.fillText('along the line, m', box.left + room.x / 2, h - 6);
    pen.save();
    pen.translate(12, box.top + room.y / 2);
    pen.rotate(-Math.PI / 2);
    pen.fillText(data.axes[2] + ', m', 0, 0);
    pen.restore();
    const picture = pen.getImageData(0, 0, sheet.width, sheet.height);
    const pixels = new Uint32Array(picture.data.buffer), colours = new Uint32Array(ramp.image.data.buffer);
    const dot = Math.max(1, Math.round((along.length > 50_000 ? 1 : 2) * ratio));
    for (let i = 0; i < along.length; ++i) {
      const x = Math.round(xOf(along[i]) * ratio), y = Math.round(yOf(height[i]) * ratio);
      const tone = colours[shade(codesOf(codes[i]), height[i])];
      for (let j = 0; j < dot; ++j) {
        for (let k = 0; k < dot; ++k) {
          if (x + k < sheet.width && y + j < sheet.height) pixels[(y + j) * sheet.width + x + k] = tone;
        }
      }
    }
    pen.putImageData(picture, 0, 0);
    section.words = 'Profile of ' + metres(length) + ', ' + grouped(String(along.length)) + ' points within ' +
      metres(wide) + (times > 1.01 ? '; heights ' + fixed(times, times < 10 ? 1 : 0) + ' times as large' : '') +
      (whole ? '' : ' …');
    part('profile-words').textContent = section.words;
  }

  function readSection(event) {
    if (!section?.xOf) return;
    const { left, top } = part('profile-points').getBoundingClientRect();
    const x = event.clientX - left, y = event.clientY - top;
    let best = reach * reach, which = -1;
    for (let i = 0; i < section.along.length; ++i) {
      const dx = section.xOf(section.along[i]) - x, dy = section.yOf(section.height[i]) - y;
      if (dx * dx + dy * dy >= best) continue;
      best = dx * dx + dy * dy;
      which = i;
    }
    part('profile-words').textContent = which < 0 ? section.words
      : fixed(section.along[which], 3) + ' m along, ' + data.axes[2] + ' ' +
        fixed(section.height[which] + data.offset_m[2], 3) + ' m, ' + valuesText(codesOf(section.codes[which]));
  }

  // ---- hands ----

  function turn(dx, dy) { // rad
    view.azimuth -= dx;
    view.elevation = Math.min(Math.max(view.elevation + dy, -mostElevation), mostElevation);
    moved();
  }
  function shift(dx, dy) { // pixels
    placeCamera();
    const unit = pixelAt(view.distance);
    view.target.addScaledVector(new Vector3().setFromMatrixColumn(camera.matrixWorld, 0), -dx * unit)
      .addScaledVector(new Vector3().setFromMatrixColumn(camera.matrixWorld, 1), dy * unit);
    moved();
  }
  function zoom(factor, about = view.target.clone()) {
    const least = data.step_m * 10, most = 20 * size;
    const allowed = Math.min(Math.max(view.distance * factor, least), most) / view.distance;
    view.distance *= allowed;
    view.target.sub(about).multiplyScalar(allowed).add(about);
    moved();
  }
  // The point under the mouse, or a point at the distance of the centre of rotation.
  function placeAt(x, y) {
    const point = pointAt(x, y);
    if (point) return point.at;
    const { origin, direction } = ray.ray;
    return origin.clone().addScaledVector(direction, view.distance);
  }
  const placeOf = (event) => {
    const { left, top } = canvas.getBoundingClientRect();
    return [event.clientX - left, event.clientY - top];
  };

  const fingers = new Map();
  let wandered = 0, hover = 0;
  canvas.addEventListener('pointerdown', (event) => {
    canvas.focus({ preventScroll: true });
    canvas.setPointerCapture(event.pointerId);
    if (fingers.size === 0) wandered = 0;
    fingers.set(event.pointerId, placeOf(event));
  });
  canvas.addEventListener('pointermove', (event) => {
    const now = placeOf(event), before = fingers.get(event.pointerId);
    if (!before) {
      clearTimeout(hover);
      hover = setTimeout(() => {
        hovered = frame.width && performance.now() - movedAt > pause ? pointAt(...now) : null;
        read();
      }, 60);
      return;
    }
    const dx = now[0] - before[0], dy = now[1] - before[1];
    wandered += Math.hypot(dx, dy);
    if (fingers.size === 2) {
      const [a, b] = [...fingers.values()], apart = Math.hypot(a[0] - b[0], a[1] - b[1]);
      fingers.set(event.pointerId, now);
      const [c, d] = [...fingers.values()], then = Math.hypot(c[0] - d[0], c[1] - d[1]);
      shift(dx / 2, dy / 2);
      if (apart > 0 && then > 0) zoom(apart / then);
      return;
    }
    fingers.set(event.pointerId, now);
    if (wandered < 4) return;
    if (event.shiftKey || event.buttons & 6) shift(dx, dy);
    else turn(dx * 0.006, dy * 0.006);
  });
  const lift = (event) => {
    if (!fingers.delete(event.pointerId)) return;
    if (event.type === 'pointerup' && event.button === 0 && wandered < 4 && fingers.size === 0) {
      click(...placeOf(event));
    }
  };
  canvas.addEventListener('pointerup', lift);
  canvas.addEventListener('pointercancel', lift);
  canvas.addEventListener('pointerleave', () => {
    clearTimeout(hover);
    hovered = null;
    read();
  });
  canvas.addEventListener('contextmenu', (event) => event.preventDefault());
  let pivot = null, pivotAt = 0;
  canvas.addEventListener('wheel', (event) => {
    event.preventDefault();
    const now = performance.now();
    if (!pivot || now - pivotAt > 300) pivot = placeAt(...placeOf(event)).clone();
    pivotAt = now;
    const lines = event.deltaMode === 1 ? 30 : 1;
    zoom(Math.exp(Math.min(Math.max(event.deltaY * lines, -300), 300) * 0.0015), pivot);
  }, { passive: false });
  canvas.addEventListener('dblclick', (event) => {
    if (tool) return;
    view.target.copy(placeAt(...placeOf(event)));
    zoom(0.5);
  });

  const helps = (open) => {
    part('help').hidden = !open;
    button('help').setAttribute('aria-expanded', String(open));
  };
  const does = {
    reset: () => showWhole(),
    top: () => showWhole(-Math.PI / 2, mostElevation),
    distance: () => useTool('distance'),
    profile: () => useTool('profile'),
    smaller: () => resizePoints(-1),
    larger: () => resizePoints(1),
    theme: () => document.getElementById('theme').click(),
    help: () => helps(part('help').hidden),
  };
  part('tools').addEventListener('click', (event) => does[event.target.dataset.does]?.());
  const arrows = { ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
  const keys = {
    '+': () => zoom(zoomStep), '=': () => zoom(zoomStep), '-': () => zoom(1 / zoomStep),
    0: does.reset, Home: does.reset, t: does.top, d: does.distance, p: does.profile,
    '[': does.smaller, ']': does.larger, '?': does.help,
    Enter: () => click(frame.width / 2, frame.height / 2),
  };
  canvas.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const arrow = arrows[event.key];
    if (arrow && event.shiftKey) shift(...arrow.map((v) => v * moveStep * frame.height));
    else if (arrow) turn(-arrow[0] * turnStep, arrow[1] * turnStep);
    else if (keys[event.key]) keys[event.key]();
    else return;
    event.preventDefault();
  });
  stage.addEventListener('keydown', (event) => {
    if (event.key !== 'Escape') return;
    helps(false);
    if (tool) useTool(tool);
  });
  part('profile-close').addEventListener('click', () => useTool('profile'));
  part('width').addEventListener('change', () => {
    const width = Number(part('width').value);
    if (section && width > 0) cut(width);
  });
  part('profile-points').addEventListener('pointermove', readSection);

  // ---- the page ----

  part('title').textContent = document.title;
  part('words').textContent = data.words;
  part('note').textContent = data.note;
  canvas.setAttribute('aria-label', document.title + ': ' + data.note);
  part('colouring').append(...colourings.map((one) => new Option(one.label)));
  part('colouring').addEventListener('change', () => {
    colouring = colourings[part('colouring').selectedIndex];
    colour();
  });
  new MutationObserver(colour).observe(page, { attributeFilter: ['data-theme'] });
  new ResizeObserver(() => {
    const first = frame.width === 0;
    Object.assign(frame, { width: canvas.clientWidth, height: canvas.clientHeight,
                           ratio: Math.min(window.devicePixelRatio || 1, 2) });
    if (frame.width === 0 || frame.height === 0) return;
    renderer.setPixelRatio(frame.ratio);
    renderer.setSize(frame.width, frame.height, false);
    screen.setSize(frame.width * frame.ratio, frame.height * frame.ratio);
    camera.aspect = frame.width / frame.height;
    resizePoints(0);
    if (first) showWhole();
    if (section) drawSection();
  }).observe(canvas);
  canvas.addEventListener('webglcontextrestored', ask);
  window.addEventListener('beforeprint', () => {
    if (frame.width === 0) return;
    placeCamera();
    render();
    const picture = new Image();
    picture.className = 'printed';
    picture.alt = document.title;
    picture.src = canvas.toDataURL();
    stage.append(picture); // page.js removes it
  });
  colour();
  loadMissing([...Array(Math.min(9, nodes.length)).keys()]);
  window.risleyViewer = {
    data, view, project: (x, y, z) => project(new Vector3(x, y, z)),
    pointAt: (x, y) => pointAt(x, y)?.at.toArray(),
    state: () => ({
      firstPicture, drawn: drawnPoints(), ends: ends.map((one) => coordinates(one.at)),
      unpacked: nodes.reduce((sum, node) => sum + (node.points ? node.count : 0), 0),
    }),
    unpackAll: () => Promise.all(nodes.map((_, i) => load(i))),
  };
})();
