MODULE Precedence
  PROC main()
    a:=1+2*3-4/5 DIV 6 MOD 7;
    b:=NOT c AND d OR e XOR f;
    b:=c AND NOT d=e;
    b:=x=NOT y;
    b:=-a*-b+ +c;
    b:=(a+b)*c<d+1;
    b:=a<b=c;
    b:=x<=1 AND y>=2 OR z<>3;
    b:=-(a-b)-c-d;
  ENDPROC
ENDMODULE
