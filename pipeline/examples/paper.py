"""The paper in ten lines: four actuators, standing and walking."""

# %%
import pipeline as lw

machine = lw.load("urdf/hexapod.toml")

# %% Standing on three legs, middle right leg (Tables III to VI)
standing = lw.stand(machine).holding
print(standing[standing["joint"] == "rm_joint_2"].to_string(index=False))

# %% Walking one cycle (section V): leg `rm` over the ideal actuator
energy = lw.walk(machine).energy
print(energy[energy["leg"] == "rm"].to_string(index=False))
