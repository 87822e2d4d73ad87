"""Pictures drawn with Plotly, for the browser."""
