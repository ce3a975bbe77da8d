// Typesets every equation of a page: \( ... \) inside a line, \[ ... \] on a line of its own.
document$.subscribe(({ body }) => {
  for (const place of body.querySelectorAll(".arithmatex")) {
    const source = place.textContent.trim();
    katex.render(source.slice(2, -2), place, {
      displayMode: source.startsWith("\\["),
      throwOnError: false,
    });
  }
});
