# SPDX-License-Identifier: GPL-3.0-or-later
"""Tunes three options on some phantoms with Optuna, and judges the best on other phantoms.

Several processes share one SQLite file, and a second call continues the search, also after `kill -9`. A trial is pruned if its error after
some steps of the schedule is above the median of the earlier trials after as many. Needs Debian's python3-optuna (3.1).
    PYTHONPATH=build/python python3 docs/examples/search_with_optuna.py --trials 60 --jobs 4 --phantoms 3
"""
import argparse, concurrent.futures, functools, multiprocessing, pathlib, statistics
import optuna, semblance

CACHE = semblance.Cache(stages=40)  # a longer schedule repeats only the fit; trials share the phantoms

# A coarse run, which takes a second.
QUICK = {"subject.rings": 24, "implicit.resolution": 60, "template.max_level": 1, "uncertainty.sigma": False, "seeds.level": 0, "first_fit": [], "face": "fit"}
SCHEDULE = [{"level": 0, "fraction": 0.5}, {"level": 0, "fraction": 0.8}, {"level": 1, "fraction": 0.5}]


def error_mm(given, options, phantoms, steps):  # of the faces after the first steps of the schedule, on average
    options = {**QUICK, **options, "fit.plan.schedule": SCHEDULE[:steps]}
    runs = [semblance.run(given.config, set={**options, "subject.random_seed": seed}, cache=CACHE) for seed in phantoms]
    return statistics.mean(run["face.rms_mm"] if run.usable else float("inf") for run in runs)


def objective(trial, given):
    options = {"interp": trial.suggest_categorical("interp", ["barycentric", "harmonic", "kriging"]),
               "seeds.weight": trial.suggest_float("seeds.weight", 0.05, 5.0, log=True),
               "implicit.emitter.decay": trial.suggest_int("implicit.emitter.decay", 2, 12)}
    for steps in range(1, len(SCHEDULE) + 1):
        trial.report(error := error_mm(given, options, range(1, given.phantoms + 1), steps), steps)
        if trial.should_prune():
            raise optuna.TrialPruned()
    return error


def open_study(given, seed):
    storage = optuna.storages.RDBStorage(f"sqlite:///{given.storage}", engine_kwargs={"connect_args": {"timeout": 60}})
    return optuna.create_study(storage=storage, study_name=f"three options, {given.phantoms} phantoms", load_if_exists=True, sampler=optuna.samplers.TPESampler(seed=seed))


def work(given, job):
    study, trials = open_study(given, given.first + job), len(range(job, given.left, given.jobs))
    study.optimize(lambda trial: objective(trial, given), n_trials=trials, catch=(semblance.InputError,))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    for name, default, text in (("trials", 4, "number of trials, those of earlier calls included"), ("jobs", 2, "number of processes"),
                                ("phantoms", 1, "number of phantoms to tune on, and of others to judge on")):
        parser.add_argument("--" + name, type=int, default=default, help=text)
    parser.add_argument("--storage", default="search.db", help="SQLite file")
    parser.add_argument("--config", default=str(pathlib.Path(__file__).parents[2] / "configs/phantom.yaml"))
    given = parser.parse_args()
    before = open_study(given, 0).trials
    given.first, given.left = len(before), given.trials - sum(trial.state.is_finished() for trial in before)
    with concurrent.futures.ProcessPoolExecutor(given.jobs, multiprocessing.get_context("spawn")) as pool:
        list(pool.map(functools.partial(work, given), range(min(given.jobs, given.left))))
    best, others = open_study(given, 0).best_trial, range(101, 101 + given.phantoms)
    print(f"the best of {given.trials}: trial {best.number}, {best.value:.3f} mm, {best.params}")
    for name, options in (("best", best.params), ("default", {})):
        print(f"{name:8s} on other phantoms: {error_mm(given, options, others, len(SCHEDULE)):.3f} mm")
