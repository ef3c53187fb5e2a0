"""Studies with people: a file says what happens, and a table does it, person by person.

=============  ==============================================================
`design`       what a study is: conditions, orders, blocks, forms
`forms`        questionnaires as data, and their scores
`progress`     what a person has done already, line by line, and what is next
`withdrawal`   what a participant did, deleted
`reading`      a study's folder as rows, which `rows` describes
`analysis`     main effects, interactions and pairs of conditions
`planning`     the plan before the data, and the power of its tests
`pages`        the page of a participant, and of the monitor
`export`       all that is published: tables, data sets of two `standards`, and a `report`
=============  ==============================================================
"""

from pathlib import Path

PAGES = Path(__file__).parent / "pages"
