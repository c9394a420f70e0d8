"""One number of an actuator changed: the reversible one with a better Harmonic Drive.

An actuator of one's own is written by `init-actuator`.
"""

# %%
import pipeline as lw

KEY = "harmonic_drive.viscous"  # [N*m*s/rad], as the catalogue writes it
today = lw.load("urdf/hexapod.toml")
better = today.with_values({KEY: 1.0})  # no file is read again

# %%
for machine in (today, better):
    energy = lw.walk(machine, "reversible").energy
    robot = energy[(energy["leg"] == "robot") & (energy["alternative"] == "reversible")]
    print(machine.changes or "catalogue", f"{robot['electrical_J'].item():.1f} J per cycle")
