"""From motion to joint demand, and the application that ties the rooms together."""
