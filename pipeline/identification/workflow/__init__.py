"""The steps of the workflow, from files to the results of a run."""
