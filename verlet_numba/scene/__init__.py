"""A scene file becomes bodies, bodies become buffers and a plan."""
