"""What a scene's user is told where a run ends: in the fields and units of the scene, and an advice is one that was tried."""

import pytest

import contin
from branches.read import read_branch
from branches.run.display import Display
from branches.run.runner import run_scene
from branches.scene import stage as stages
from branches.scene.fields import ConfigError
from branches.scene.parse import parse

DIMENSIONS = "{width: 0.01, thickness: 0.0005, length: 0.4, poisson_ratio: 0.3, youngs_modulus: 200.0e9}"
ARCH = "material: {law: flat rod, nu: 0.3}\nnumbers: {distance: 0.95}\nbegin: arch\n"
#: Words of the engine and of Python that a scene does not know.
FOREIGN = ("abs", "max,", "Newton(", "MeshControl", "min_step", "newton=", "scales", "the equations")


def followed(text, tmp_path, settings=()):
    path = tmp_path / "scene.h5"
    outcome = run_scene(parse(text, "scene", list(settings)), path, Display(silent=True), overwrite=True)
    return outcome, read_branch(path)


def assert_scene_words(text):
    assert not [word for word in FOREIGN if word in text]


@pytest.mark.sample(1)
@pytest.mark.parametrize(("m", "n"), [(1, 2), (1, 3), (3, 1)])
def test_an_advice_names_a_field_of_the_scene_and_the_run_goes_on_with_it(m, n, tmp_path):
    """Branches cannot be followed with steps of 1; the advised field is set here as the scene's user would."""
    scene = f"{{m: {m}, n: {n}, steps: {{smallest: 1, largest: 9, first: 5}}}}"
    outcome = run_scene(parse(scene, "scene"), tmp_path / "x.h5", Display(silent=True))
    branch = read_branch(tmp_path / "x.h5")
    assert outcome == "lost" and branch.stop.startswith("no state was found beyond kappa_n = ")
    assert_scene_words(branch.stop)
    key, value = branch.stop.partition("; the run goes on with ")[2].split(": ")
    changed = parse(scene, "scene", [f"{key}={value}", "steps.max_points=30"])
    run_scene(changed, tmp_path / "y.h5", Display(silent=True))
    assert len(read_branch(tmp_path / "y.h5").points) > len(branch.points) + 10


@pytest.mark.full
def test_a_failed_stage_of_a_law_with_an_end_is_told_so(tmp_path):
    """A ribbon whose thickness falls: the least margin lies inside, and the engine speaks of abs and max."""
    scene = 'material: {law: ribbon, nu: 0.3, kappa_n: 1}\nalong: {thickness: "1 - s/2"}\nfinish: free\n'
    outcome, branch = followed(f"{scene}stages: [{{follow: force_normal, to: 5}}]\n", tmp_path)
    assert outcome == "complete" and "stage 1: the end of the law 'ribbon', which has no value where" in branch.stop
    assert_scene_words(branch.stop)
    assert all(len(event["name"]) < 64 for event in branch.events)  # names were cut in the middle of a word


def test_a_corner_is_not_blamed_on_equations_that_a_scene_does_not_have(monkeypatch):
    """The engine's sentence about abs is replaced; with no change that helps, none is advised."""
    problem = contin.AlgebraicProblem(lambda u, p: (u.x - abs(p.a),), ["x"], {"a": -1.0})
    run = contin.lowlevel.Continuation(*_free(problem), contin.Settings(limits={"a": (-1, 1)}))
    list(run)
    monkeypatch.setattr(stages, "_goes_on", lambda *_: False)
    stop = stages.no_state(run, "a = 0")
    assert_scene_words(str(stop)) and "no state was found beyond a = 0: neither smaller steps nor" in str(stop)


def _free(problem):
    point = contin.solve(problem, [1.0])
    return point.system.with_free(["a"], point.x)


def test_a_reason_of_another_kind_is_kept():
    """Where steps succeed from the last state, the run has met something else, and says what."""
    circle = contin.AlgebraicProblem(lambda u, p: (u.x**2 + p.a**2 - 1,), ["x"], {"a": 0.6})
    point = contin.solve(circle, [0.8])
    run = contin.lowlevel.Continuation(*point.system.with_free(["a"], point.x), contin.Settings(max_points=5))
    list(run)
    run.stop = contin.lowlevel.Stop("no convergence", "h changed its sign, but no zero of it was found on the branch")
    assert stages.no_state(run, "a = 1") is run.stop


@pytest.mark.full
@pytest.mark.parametrize(
    ("scene", "sentence"),
    [
        (
            "material: {law: flat rod, nu: 0.3}\nnumbers: {distance: 0.05, turn: 30}\nbegin: twisted\n"
            "stages: [{follow: turn, to: 31}]\n",
            "begin with distance, turn nearer to the natural state, and follow them in a stage; or begin with another first",
        ),
        (
            "material: {law: flat rod, nu: 0.3}\nclosed: {half_twists: 1}\nbegin: circle\nphases: ['shift, right']\n"
            "stages: [{follow: nu, to: 0.2}]\n",
            "begin with a softness (1, say), and follow them in a stage; or begin with another first state",
        ),
    ],
)
def test_a_first_state_that_is_not_found_asks_for_what_the_scene_has(scene, sentence, tmp_path):
    """It asked for smaller loads where there were none."""
    with pytest.raises(ConfigError) as caught:
        followed(scene, tmp_path)
    assert sentence in str(caught.value) and "load" not in str(caught.value)


def test_numbers_that_change_too_much_are_named(tmp_path):
    """The sentence held the updates of Newton's method."""
    stages = "stages: [{follow: distance, to: 0.9}, {follow: turn, to: 1, numbers: {distance: 0.1, bend: 3}}]\n"
    outcome, branch = followed(f"{ARCH}{stages}", tmp_path)
    assert outcome == "lost" and "no state was found near the one before with distance = 0.1, bend = 3; follow" in branch.stop
    assert "updates" not in branch.stop


def test_a_state_that_is_not_found_again_is_told_in_a_sentence(tmp_path, monkeypatch):
    """A bare "Newton did not converge (updates ...)" of the engine came through."""

    def fails(*_):
        raise contin.ConvergenceError("Newton did not converge (updates 1e+00, 2e+00)")

    monkeypatch.setattr("branches.scene.open_stage.OpenStage._begun", fails)
    with pytest.raises(ConfigError, match="follow: 'turn': the state at the start of the stage was not found again") as caught:
        followed(f"{ARCH}stages: [{{follow: turn, to: 1}}]\n", tmp_path)
    assert "updates" not in str(caught.value)


def test_the_stop_and_the_names_of_points_are_in_the_scene_s_units(tmp_path):
    """A strip of 0.4 m was said to have reached distance = 0.75."""
    scene = f"material: {{}}\ndimensions: {DIMENSIONS}\nnumbers: {{distance: 0.39}}\nbegin: arch\n"
    outcome, branch = followed(f"{scene}stages: [{{follow: distance, to: 0.3, label: {{distance: [0.35]}}}}]\n", tmp_path)
    assert (outcome, branch.stop) == ("complete", "reached distance = 0.3 m")
    assert [event["name"] for event in branch.events] == [b"start", b"distance = 0.35 m", b"distance = 0.3 m"]
    assert branch.events["distance"].tolist() == pytest.approx([0.39 / 0.4, 0.35 / 0.4, 0.3 / 0.4])


@pytest.mark.full
def test_a_stage_that_turns_back_says_that_it_did_not_arrive(tmp_path):
    """A clamped strip of length 1 cannot be pulled to a distance of 1.1: the run goes through the straight state and back."""
    stages = "stages: [{follow: distance, to: 1.1}]\n"
    outcome, branch = followed(f"{ARCH}{stages}", tmp_path)
    assert (
        outcome == "complete"
        and "stage 1: distance = 1.1 was not reached: the strip came back, to distance = 0.8" in branch.notes
    )
    outcome, branch = followed(f"{ARCH}{stages.replace('1.1', '0.9')}", tmp_path)
    assert not [note for note in branch.notes if "was not reached" in note]
