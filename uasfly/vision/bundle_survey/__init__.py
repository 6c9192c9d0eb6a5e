"""Where the markers of a bundle are, from pictures of it: views, a start from pairs, bundle adjustment, the file."""
