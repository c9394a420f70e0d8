"""Two finished runs side by side: what their folders say, and nothing computed anew."""
