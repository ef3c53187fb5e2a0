"""What participants read."""

from swarm_pz.play.studies.texts import html_of


def test_a_text_is_shown_with_its_headings_below_the_pages():
    shown = html_of("# Will you?\n\nTake *part*.\n\n### Data\n\n- one\n\n## More\n\n| a | b |\n|---|---|\n| 1 | 2 |\n")
    for part in ("<h2>Will you?</h2>", "<em>part</em>", "<h3>Data</h3>", "<li>one</li>", "<h3>More</h3>", "<td>2</td>"):
        assert part in shown


def test_a_text_brings_nothing_that_acts_or_is_fetched():
    shown = html_of('<script>alert(1)</script>\n\n<b onclick="x">b</b>\n\n[go](javascript:alert(1)) ![p](p.png)')
    assert "<script" not in shown and "<b" not in shown and 'href="javascript' not in shown and "<img" not in shown
    assert "&lt;script&gt;" in shown
