// Lets a dotted path in a table break after its dots and underscores, not within a name.
document$.subscribe(({ body }) => {
  for (const path of body.querySelectorAll(".md-typeset td > code")) {
    if (path.textContent.length > 12) {
      path.innerHTML = path.innerHTML.replace(/(?<=\w)[._](?=\w)/g, "$&<wbr>");
    }
  }
});
