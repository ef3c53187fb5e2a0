"""Studies with people: a file defines all steps, and the server leads each participant through them.

=============  ==============================================================
`design`       what a study is: conditions, orders, blocks, forms
`forms`        questionnaires as data, and their scores
`progress`     a participant's finished steps, a line each, and the next step
`withdrawal`   deletion of a participant's data
`reading`      a study's folder as rows, which `rows` describes
`analysis`     main effects, interactions and pairs of conditions
`planning`     the plan made before the data, and the power of its tests
`pages`        the page of a participant, and of the monitor
`export`       a data set to publish: tables, plan, materials and a `report`
=============  ==============================================================
"""

from pathlib import Path

PAGES = Path(__file__).parent / "pages"
