"""Imports between files, those inside functions and for types included."""

from graphlib import TopologicalSorter

import grimp


def test_no_files_import_each_other_in_a_circle():
    graph = grimp.build_graph("echobeam", exclude_type_checking_imports=False)
    imports = {file: graph.find_modules_directly_imported_by(file) for file in graph.modules}
    assert sum(map(len, imports.values())) > len(imports)
    TopologicalSorter(imports).prepare()  # a CycleError names the circle
