"""A log with a gap: what the model lacks, and what is left once it is written into the model."""

# %%
import pipeline as lw

machine = lw.load("urdf/hexapod.toml")
log = lw.read_log("pipeline/identification/demo/walk.parquet", machine)
print(log.quality["verdict"].value_counts().to_string())

# %%
test = "pipeline/identification/demo/walk_slow.parquet"
result = lw.gap(log, machine, test=test)
print(result.found.to_string(index=False))
before, after = result.gap
print(f"gap on rows that had no say: {before:.4f} A, with the model as written {after:.4f} A")

# %% The same machine walks with what was found
for one in (machine, result.model):
    energy = lw.walk(one, "rotor").energy
    robot = energy[(energy["leg"] == "robot") & (energy["alternative"] == "rotor")]
    print(f"rotor: {robot['electrical_J'].item():.1f} J per cycle")
