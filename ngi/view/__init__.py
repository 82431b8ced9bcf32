"""Looking at trained networks: pictures, videos, the interactive viewer."""
