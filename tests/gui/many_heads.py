"""The window's tests of several heads: another person, the list of heads, and an update."""

import listed
from session import ANSWER_SECONDS, Session, expect
from steps import (
    CLIP_FIELD,
    HAPPINESS,
    PARTS,
    RECONSTRUCT,
    SECOND_PARTS,
    choose_first_head,
    difference,
    expect_one_step,
    expect_same,
    finish,
    undo,
)


def a_second_person_is_a_second_head(session: Session) -> None:
    first = finish(session, RECONSTRUCT)
    session.type_into(CLIP_FIELD, str(session.mirrored_clip()))
    session.wait("another clip is for a new head", ANSWER_SECONDS, lambda s: s["head"] == "NEW")
    both = finish(session, RECONSTRUCT)
    expect(both["data"].keys() >= SECOND_PARTS, f"parts are missing: {difference(first, both)}")
    expect_same(PARTS, first, both)
    session.picture("two-heads")
    session.click_button(HAPPINESS)
    smiling = session.wait("the new head smiles", ANSWER_SECONDS, lambda s: s["smiles"]["Face.001"] > 0.3)
    expect(smiling["smiles"]["Face"] == 0.0, "the first head smiles with it")
    choose_first_head(session)
    updated = finish(session, RECONSTRUCT)
    expect_same(SECOND_PARTS, both, updated)
    expect(updated["data"].keys() == both["data"].keys(), f"it is not updated: {difference(both, updated)}")
    expect(updated["data"]["object Face"] != both["data"]["object Face"], "the first head is not what the clip shows")
    session.picture("two-heads-updated")
    session.picture_of_editor("panel-of-two")


def heads_are_chosen_named_copied_and_removed_in_the_list(session: Session) -> None:
    first = finish(session, RECONSTRUCT)
    copied = listed.duplicate(session)
    listed.expect_alike(copied, "Face", "Face.001")
    expect_same(PARTS, first, copied)
    expect_one_step(first, copied)
    session.picture("heads-duplicated")
    undo(session, "ctrl+z", first)
    undo(session, "ctrl+shift+z", copied)
    chosen = listed.choose(session, 0, "Face")
    expect(chosen["data"] == copied["data"], f"a click changes {difference(copied, chosen)}")
    session.click_button(HAPPINESS)
    smiling = session.wait("the chosen head smiles", ANSWER_SECONDS, lambda s: s["smiles"]["Face"] > 0.3)
    expect(smiling["smiles"]["Face.001"] == 0.0, "the copy smiles with it")
    listed.choose(session, 1, "Face.001")
    before = session.settled()
    named = listed.rename(session, 1, "Twin")
    expect({"object Twin", "object Twin tongue", "image Twin skin"} <= named["data"].keys(), "not all is called Twin")
    # The first of the two clicks is a choice, and a step, too.
    undo(session, "ctrl+z", before)
    undo(session, "ctrl+shift+z", named)
    session.picture_of_editor("heads-list")
    before_removal = session.settled()
    removed = listed.remove(session)
    expect(removed["data"].keys() >= PARTS, "the other head is gone too")
    expect(not any("Twin" in name for name in removed["data"]), "something of the head is left")
    expect_one_step(before_removal, removed)
    undo(session, "ctrl+z", before_removal)
    session.picture_of_editor("heads-restored")
    undo(session, "ctrl+shift+z", removed)


def an_update_that_is_undone_gives_back_shape_and_skin(session: Session) -> None:
    made = finish(session, RECONSTRUCT)
    session.type_into(CLIP_FIELD, str(session.mirrored_clip()))
    choose_first_head(session)
    updated = finish(session, RECONSTRUCT)
    expect(updated["data"].keys() == made["data"].keys(), f"it is not updated: {difference(made, updated)}")
    for changed in ("object Face", "image Face skin", "image Face eyes"):
        expect(updated["data"][changed] != made["data"][changed], f"{changed} is not of the other person")
    undo(session, "ctrl+z", made)
    undo(session, "ctrl+shift+z", updated)
    session.picture("update-redone")
