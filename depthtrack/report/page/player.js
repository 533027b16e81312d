// Animation, slider and plot share one time; a click on the plot or on a worst frame seeks to its time.
for (const section of document.querySelectorAll("section.recording")) {
  const animation = JSON.parse(section.querySelector("script.animation").textContent);
  const canvas = section.querySelector("canvas"), context = canvas.getContext("2d");
  const button = section.querySelector(".controls button"), slider = section.querySelector("input");
  const output = section.querySelector("output"), line = section.querySelector(".timeline"), head = line.querySelector(".playhead");
  const from = Number(line.dataset.from), to = Number(line.dataset.to), end = Number(line.dataset.end);
  const pictures = animation.images.map((uri) => ({ uri, image: null }));
  let number = 0, drawn = -1, playing = false, begun = 0, since = 0;

  const nearest = (seconds) => {
    let best = 0;
    animation.seconds.forEach((at, k) => { if (Math.abs(at - seconds) < Math.abs(animation.seconds[best] - seconds)) best = k; });
    return best;
  };
  const load = (k) => {
    const picture = pictures[k];
    if (picture && !picture.image) { picture.image = new Image(); picture.image.src = picture.uri; }
    return picture && picture.image;
  };
  const show = (k) => {
    number = k;
    const image = load(k);
    for (let ahead = 1; ahead < 12; ahead++) load(k + ahead);
    const draw = () => {
      // A late image still replaces an older one while playing.
      if (number !== k && !(playing && k > drawn)) return;
      drawn = k;
      context.drawImage(image, 0, 0, canvas.width, canvas.height);
    };
    if (image.complete && image.naturalWidth) draw(); else image.onload = draw;
    const seconds = animation.seconds[k];
    slider.value = k;
    output.textContent = `${seconds.toFixed(2)} s of ${end.toFixed(1)} s`;
    head.style.left = `${from + (to - from) * Math.min(seconds / end, 1)}%`;
  };
  const stop = () => { playing = false; button.textContent = "Play"; };
  const step = (now) => {
    if (!playing) return;
    const seconds = begun + (now - since) / 1000;
    if (seconds > animation.seconds[animation.seconds.length - 1]) { stop(); return; }
    const next = nearest(seconds);
    if (next !== number) show(next);
    requestAnimationFrame(step);
  };
  const play = () => {
    if (number >= animation.seconds.length - 1) number = 0;
    playing = true; drawn = -1; button.textContent = "Pause"; begun = animation.seconds[number]; since = performance.now();
    requestAnimationFrame(step);
  };
  const toggle = () => (playing ? stop() : play());
  const go = (seconds) => { stop(); show(nearest(seconds)); };

  button.onclick = toggle; canvas.onclick = toggle;
  slider.max = animation.seconds.length - 1;
  slider.oninput = () => { stop(); show(Number(slider.value)); };
  const point = (event) => {
    const box = line.getBoundingClientRect();
    go(end * ((100 * (event.clientX - box.left)) / box.width - from) / (to - from));
  };
  line.onpointerdown = (event) => { line.setPointerCapture(event.pointerId); point(event); };
  line.onpointermove = (event) => { if (event.buttons) point(event); };
  for (const worst of section.querySelectorAll(".worst button")) {
    worst.onclick = () => { go(Number(worst.dataset.seconds)); canvas.scrollIntoView({ behavior: "smooth", block: "nearest" }); };
  }
  show(0);
}
