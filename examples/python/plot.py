"""Small drawings as SVG, without a library: points of two groups side by side, and paths from above."""

COLOURS = ["#0072b2", "#d55e00", "#009e73", "#999999"]  # Okabe and Ito's, told apart by the colour-blind


def svg(width, height, parts):
    return (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif" font-size="13">'
            f'<rect width="{width}" height="{height}" fill="white"/>' + "".join(parts) + "</svg>\n")


def text(x, y, words, colour="#222", anchor="start"):
    return f'<text x="{x:.1f}" y="{y:.1f}" fill="{colour}" text-anchor="{anchor}">{words}</text>'


def groups(title, unit, values):
    """`values`: name -> numbers, one column of points for each, with its median as a line."""
    width, height, top, bottom = 120 + 180 * len(values), 300, 50, 260
    most = 1.1 * max(max(numbers) for numbers in values.values())
    parts = [text(16, 26, title)]
    for tick in range(5):
        y = bottom - tick * (bottom - top) / 4
        parts.append(f'<line x1="80" x2="{width - 16}" y1="{y}" y2="{y}" stroke="#ddd"/>')
        parts.append(text(74, y + 4, f"{tick * most / 4:.3f}{' ' + unit if tick == 4 else ''}", anchor="end"))
    for column, (name, numbers) in enumerate(values.items()):
        x, colour = 170 + 180 * column, COLOURS[column % len(COLOURS)]
        place = [bottom - (bottom - top) * number / most for number in sorted(numbers)]
        for i, y in enumerate(place):
            parts.append(f'<circle cx="{x + 40 * (i / max(1, len(place) - 1) - 0.5):.1f}" cy="{y:.1f}" r="4" fill="{colour}"/>')
        middle = (place[(len(place) - 1) // 2] + place[len(place) // 2]) / 2
        parts.append(f'<line x1="{x - 40}" x2="{x + 40}" y1="{middle:.1f}" y2="{middle:.1f}" stroke="{colour}" stroke-width="2"/>')
        parts.append(text(x, bottom + 24, name, colour, "middle"))
    return svg(width, height, parts)


def paths(title, named):
    """`named`: name -> positions (n, 2) [m], drawn to one scale."""
    width, height, margin = 640, 480, 50
    points = [point for path in named.values() for point in path]
    low = [min(p[axis] for p in points) for axis in (0, 1)]
    high = [max(p[axis] for p in points) for axis in (0, 1)]
    scale = min((width - 2 * margin) / max(high[0] - low[0], 1e-6), (height - 2 * margin) / max(high[1] - low[1], 1e-6))
    parts = [text(16, 26, title)]
    for i, (name, path) in enumerate(named.items()):
        colour = COLOURS[-1] if name == "truth" else COLOURS[i % len(COLOURS)]
        line = " ".join(f"{margin + scale * (x - low[0]):.1f},{height - margin - scale * (y - low[1]):.1f}" for x, y in path)
        stroke = 5 if name == "truth" else 1.5
        parts.append(f'<polyline points="{line}" fill="none" stroke="{colour}" stroke-width="{stroke}"/>')
        parts.append(text(width - 16, 26 + 18 * i, name, colour, "end"))
    parts.append(f'<line x1="{margin}" x2="{margin + scale:.1f}" y1="{height - 20}" y2="{height - 20}" stroke="#222"/>')
    parts.append(text(margin + scale + 6, height - 16, "1 m"))
    return svg(width, height, parts)
