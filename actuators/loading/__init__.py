"""From the catalogue's files to components and chains."""
