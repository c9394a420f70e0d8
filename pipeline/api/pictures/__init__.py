"""The robot in pictures: scenes, figures of robot and gait, the player in a browser."""
