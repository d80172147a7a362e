"""Where is a casting too thick? Makes a housing, measures it, and writes what a casting engineer wants to see.

Run: python examples/heavy_sections.py [part.stl] [limit]
"""

import sys

import truefield as tf


def main() -> None:
    """Reports the heavy sections of a part, thicker than a limit in the part's own units."""
    part = tf.read(sys.argv[1]) if len(sys.argv) > 1 else tf.shapes.housing()
    limit = float(sys.argv[2]) if len(sys.argv) > 2 else 10.0

    report = tf.thickness(part, tolerance=0.05, above=limit)
    for number, section in enumerate(report.heavy_sections, 1):
        x, y, z = section.point
        depth, volume = section.depth, section.volume
        print(
            f"{number}. a ball of diameter {2.0 * depth.lower:.2f} to {2.0 * depth.upper:.2f} fits in "
            f"at ({x:.1f}, {y:.1f}, {z:.1f}); {volume.lower:.0f} to {volume.upper:.0f} cubic units are too thick"
        )
    print(*report.sentences(), sep="\n")
    report.write("heavy-sections")

    # The core of the heavy sections: all places exactly half the limit deep.
    shell = tf.Surface(part).contour(-0.5 * limit, tolerance=0.2)
    shell.write("heavy-sections.ply")


if __name__ == "__main__":
    main()
