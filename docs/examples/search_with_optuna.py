# SPDX-License-Identifier: GPL-3.0-or-later
"""Searches for the best scheme of tissue depths and its parameters on phantoms: Optuna calls the Python module (docs/python.md).

Several processes share one SQLite file. A second call with the same file continues the search, also after `kill -9`: the trials that ended stay, and
interrupted trials are not counted. Needs Debian's python3-optuna (3.1).
    PYTHONPATH=build/python python3 docs/examples/search_with_optuna.py --trials 60 --jobs 4 --phantoms 3
"""
import argparse, concurrent.futures, functools, multiprocessing, pathlib

import optuna
import semblance

# A coarse run, which takes seconds. Empty this dictionary to search at the default resolution.
QUICK = {"subject.rings": 24, "implicit.resolution": 16, "seeds.level": 0, "template.max_level": 1, "first_fit": [],
         "fit.plan.schedule": [{"level": 0, "fraction": 1}], "uncertainty.sigma": False}


def objective(trial, given):
    interp = {"type": trial.suggest_categorical("interp", ["barycentric", "harmonic", "kriging"])}
    if interp["type"] == "kriging":
        interp["covariance"] = trial.suggest_categorical("covariance", ["matern_1_2", "matern_3_2", "matern_5_2"])
    options = {**QUICK, "interp": interp, "seeds.weight": trial.suggest_float("seeds.weight", 0.05, 5.0, log=True)}
    errors_mm = []
    for seed in range(1, given.phantoms + 1):
        run = semblance.run(given.config, set={**options, "subject.random_seed": seed})
        if run["faults"]:
            raise optuna.TrialPruned("; ".join(run["faults"]))
        errors_mm.append(run["result"]["face"]["rms_mm"])
        trial.report(sum(errors_mm) / seed, seed)
        if trial.should_prune():  # worse than the median of the earlier trials after as many phantoms
            raise optuna.TrialPruned()
    return sum(errors_mm) / len(errors_mm)


def open_study(given, seed):
    storage = optuna.storages.RDBStorage(f"sqlite:///{given.storage}", engine_kwargs={"connect_args": {"timeout": 60}})
    return optuna.create_study(storage=storage, study_name=f"{given.phantoms} phantoms", load_if_exists=True, sampler=optuna.samplers.TPESampler(seed=seed))


def work(given, job):
    trials = len(range(job, given.left, given.jobs))
    open_study(given, given.first + job).optimize(lambda trial: objective(trial, given), n_trials=trials, catch=(semblance.InputError,))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=4, help="number of trials, those of earlier calls included")
    parser.add_argument("--jobs", type=int, default=2, help="number of processes")
    parser.add_argument("--phantoms", type=int, default=1, help="number of phantoms; the search minimises their mean RMS error")
    parser.add_argument("--storage", default="search.db", help="SQLite file")
    parser.add_argument("--config", default=str(pathlib.Path(__file__).resolve().parents[2] / "configs/phantom.yaml"))
    given = parser.parse_args()
    before = open_study(given, 0).trials
    given.first, given.left = len(before), given.trials - sum(trial.state.is_finished() for trial in before)
    with concurrent.futures.ProcessPoolExecutor(given.jobs, multiprocessing.get_context("spawn")) as pool:
        list(pool.map(functools.partial(work, given), range(min(given.jobs, given.left))))
    done = open_study(given, 0).get_trials(states=[optuna.trial.TrialState.COMPLETE])
    print(f"{len(done)} trials completed; the best:")
    for trial in sorted(done, key=lambda trial: trial.value)[:5]:
        print(f"  {trial.value:.3f} mm  trial {trial.number}  {trial.params}")
