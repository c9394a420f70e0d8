"""The steps of the workflow, from files to what a run tells."""
