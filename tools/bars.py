"""Draws bars as SVG that is readable on light and dark pages."""

COLOURS = ["#2a7", "#68a", "#a86", "#888"]
WIDTH, LABELS, ROW = 680, 90, 18


def picture(title, groups):
    """Groups of bars: texts of numbers by name, by group. The longest bar of all is cut off."""
    longest = sorted(float(value) for bars in groups.values() for value in bars.values())[-2]
    body, y = [f'<text x="10" y="14">{title}</text>'], 34
    for group, bars in groups.items():
        body.append(f'<text x="10" y="{y}" font-weight="bold">{group}</text>')
        for colour, (name, value) in zip(COLOURS, bars.items()):
            y += ROW
            cut = float(value) > longest
            wide = (WIDTH - LABELS - 70) * min(float(value) / longest, 1)
            body.append(f'<text x="{LABELS - 10}" y="{y}" text-anchor="end">{name}</text>')
            body.append(f'<rect x="{LABELS}" y="{y - 11}" width="{wide:.1f}" height="13" fill="{colour}"/>')
            body.append(f'<text x="{LABELS + 6 + wide:.1f}" y="{y}">{value}{" (cut)" * cut}</text>')
        y += ROW + 8
    style = 'font-family="sans-serif" font-size="12" fill="#777"'
    head = f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{y}" {style}>'
    return "\n".join([head, *body, "</svg>"]) + "\n"
